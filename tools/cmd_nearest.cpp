// filiform nearest: nearest segments to points from the command line, a file or stdin.
#include "index/cell_graph.h"
#include "index/errors.h"
#include "index/nearest.h"
#include "index/text.h"
#include "index/tile_set.h"
#include "tools/cli.h"

#include <charconv>
#include <fstream>
#include <iostream>
#include <iterator>
#include <map>
#include <sstream>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

namespace filiform::tools {

namespace {

struct NearestArguments {
  std::string set, points, budget = "256MiB", engine = "cgal";
  std::vector<std::string> coordinates;
  std::size_t k = 1;
  double epsilon = 0;
  bool approximate = false, json = false, tsv = false;
};

std::vector<Vector3d> readPoints(std::istream& in, const std::string& name) {
  std::vector<Vector3d> points;
  std::string line;
  for (std::size_t number = 1; std::getline(in, line); ++number) {
    line.erase(std::min(line.find('#'), line.size()));
    for (char& c : line)
      if (c == ',' || c == '\t' || c == '\r') c = ' ';
    std::istringstream words(line);
    const std::vector<std::string> fields{std::istream_iterator<std::string>(words), {}};
    if (fields.empty()) continue;
    const std::string where = name + ":" + std::to_string(number);
    if (fields.size() != 3) throw UsageError(where + ": " + std::to_string(fields.size()) + " fields, want x y z");
    points.emplace_back(parseNumber(where + ": x", fields[0]), parseNumber(where + ": y", fields[1]),
                        parseNumber(where + ": z", fields[2]));
  }
  if (in.bad()) throw IoError(name, "cannot read");
  return points;
}

std::vector<Vector3d> pointsOf(const NearestArguments& a) {
  if (a.points.empty() == a.coordinates.empty())
    throw UsageError("nearest: give either X Y Z or --points FILE (- for stdin)");
  if (a.points.empty())
    return {Vector3d(parseNumber("X", a.coordinates[0]), parseNumber("Y", a.coordinates[1]),
                     parseNumber("Z", a.coordinates[2]))};
  if (a.points == "-") return readPoints(std::cin, "stdin");
  std::ifstream file(a.points);
  if (!file) throw IoError(escaped(a.points), "cannot open", errno);
  return readPoints(file, escaped(a.points));
}

// Segments of a forest are named after their child; in a graph with loops its links tell.
std::vector<std::int64_t> childIds(const TileSet& set, std::uint32_t cell) {
  if (!hasLoops(set.cell(cell))) return set.loadCellDetail(cell).sample_ids;
  const CellGraph graph = readCell(set, cell, false);
  std::vector<std::int64_t> ids;
  for (const auto& link : graph.links) ids.push_back(graph.sample_ids[link[0]]);
  return ids;
}

int runNearest(const NearestArguments& a) {
  const std::vector<Vector3d> points = pointsOf(a);
  const auto set = TileSet::open(a.set);
  const Nearest nearest(*set, {.engine = a.engine, .budget_bytes = parseBytes("--budget", a.budget)});
  const NearestQuery query{.k = a.k, .epsilon = a.epsilon, .approximate = a.approximate};

  std::map<std::uint32_t, std::vector<std::int64_t>> sample_ids;  // of the cells met: of the child, by segment
  if (a.json)
    std::cout << '[';
  else
    std::cout << "query\trank\tdistance\tx\ty\tz\tcell\tsegment\tsample\texact\ttiles_read\n";
  const char* separator = "\n";
  for (std::size_t i = 0; i < points.size(); ++i) {
    throwIfInterrupted();
    for (const NearestResult& r : nearest.find(points[i], query)) {
      const std::string& cell = set->cell(r.segment.cell).name;
      auto ids = sample_ids.find(r.segment.cell);
      if (ids == sample_ids.end()) ids = sample_ids.emplace(r.segment.cell, childIds(*set, r.segment.cell)).first;
      const std::int64_t sample = ids->second.at(r.segment.segment);
      if (a.json) {
        const nlohmann::ordered_json row{{"query", i},
                                         {"rank", r.rank},
                                         {"distance", r.distance_um},
                                         {"x", r.p_W.x()},
                                         {"y", r.p_W.y()},
                                         {"z", r.p_W.z()},
                                         {"cell", cell},
                                         {"segment", r.segment.segment},
                                         {"sample", sample},
                                         {"exact", r.exact},
                                         {"tiles_read", r.tiles_read}};
        std::cout << separator << row.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
        separator = ",\n";
      } else {
        std::cout << i << '\t' << r.rank << '\t' << formatNumber(r.distance_um) << '\t' << formatNumber(r.p_W.x())
                  << '\t' << formatNumber(r.p_W.y()) << '\t' << formatNumber(r.p_W.z()) << '\t' << escaped(cell) << '\t'
                  << r.segment.segment << '\t' << sample << '\t' << (r.exact ? "true" : "false") << '\t' << r.tiles_read
                  << '\n';
      }
    }
  }
  if (a.json) std::cout << "\n]\n";
  return 0;
}

}  // namespace

void addNearest(CLI::App& app, Chosen& chosen) {
  auto arguments = std::make_shared<NearestArguments>();
  CLI::App* command = app.add_subcommand("nearest", "Nearest segments to a point, or to many");
  command->footer(
      "Example:\n  filiform nearest column.fil 12.5 -300 40 --k 3\n  filiform nearest column.fil --points soma.txt "
      "--json");
  command->add_option("SET", arguments->set, "tile set")->required();
  command->add_option("XYZ", arguments->coordinates, "a point, um")->expected(0, 3)->type_name("X Y Z");
  command->add_option("--points", arguments->points, "file of points, one 'x y z' a line; - for stdin")
      ->type_name("FILE");
  command->add_option("--k", arguments->k, "how many segments a point")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000000));
  command->add_option("--epsilon", arguments->epsilon, "answers may be (1 + E) times too far, and no more")
      ->type_name("E")
      ->capture_default_str();
  command->add_flag("--approximate", arguments->approximate, "from the set's samples alone, without reading a tile");
  command->add_option("--engine", arguments->engine, "search structure inside a tile: cgal")->capture_default_str();
  command->add_option("--budget", arguments->budget, "memory for tiles between queries")
      ->capture_default_str()
      ->type_name("BYTES");
  command->add_flag("--json", arguments->json, "one JSON array");
  command->add_flag("--tsv", arguments->tsv, "tab-separated rows (the default)")->excludes("--json");
  command->callback([arguments, &chosen] {
    if (!arguments->coordinates.empty() && arguments->coordinates.size() != 3)
      throw CLI::ValidationError("nearest", "give three coordinates: X Y Z");
    chosen = [arguments] { return runNearest(*arguments); };
  });
}

}  // namespace filiform::tools
