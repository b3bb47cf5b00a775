// filiform nearest: finds the segments nearest to points on the command line, in a file or on stdin.
#include "index/errors.h"
#include "index/query/nearest.h"
#include "index/set/cell_graph.h"
#include "index/set/tile_set.h"
#include "index/text.h"
#include "tools/answers/answer.h"
#include "tools/answers/sample_ids.h"
#include "tools/answers/segment_row.h"
#include "tools/commands/commands.h"
#include "tools/commands/remote_arguments.h"
#include "tools/program/interruption.h"
#include "tools/program/numbers.h"

#include <charconv>
#include <fstream>
#include <iostream>
#include <iterator>
#include <map>
#include <optional>
#include <span>
#include <sstream>
#include <utility>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

namespace filiform::tools {

namespace {

struct NearestArguments {
  std::shared_ptr<const RemoteArguments> remote;
  std::string set, points, budget = "256MiB", engine = "packed";
  std::vector<std::string> coordinates, box, ray;
  std::size_t k = 1;
  double epsilon = 0, radius = -1, tolerance = 1, slope = 0;
  unsigned threads = 1;
  bool k_given = false, approximate = false, json = false, tsv = false;
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
    if (fields.size() != 3)
      throw UsageError(where + ": " + std::to_string(fields.size()) + " fields; give three: x y z");
    points.emplace_back(parseNumber(where + ": x", fields[0]), parseNumber(where + ": y", fields[1]),
                        parseNumber(where + ": z", fields[2]));
  }
  if (in.bad()) throw IoError(name, "cannot read");
  return points;
}

std::vector<double> numbers(const std::string& option, const std::vector<std::string>& words) {
  std::vector<double> values;
  for (const std::string& word : words) values.push_back(parseNumber(option, word));
  return values;
}

constexpr std::size_t kBatch = 65536;  // points whose results are held at once

// Writes the results as TSV or as one JSON array.
class Rows {
 public:
  Rows(const TileSet& set, bool json, bool along) : set_(set), json_(json), along_(along) {}
  void write(std::size_t query, const NearestResult& r, std::optional<double> along = {}) {
    begin();
    const std::string& cell = set_.cell(r.segment.cell).name;
    auto ids = sample_ids_.find(r.segment.cell);
    if (ids == sample_ids_.end()) ids = sample_ids_.emplace(r.segment.cell, childSampleIds(set_, r.segment.cell)).first;
    const std::int64_t sample = ids->second.at(r.segment.segment);
    if (json_) {
      const SegmentRow row{query, &r, &cell, sample, along};
      std::cout << std::exchange(separator_, ",\n") << jsonText(segmentRowJson(row, SegmentRowFields::program));
    } else {
      std::cout << query << '\t' << r.rank << '\t' << formatNumber(r.distance_um) << '\t' << formatNumber(r.p_W.x())
                << '\t' << formatNumber(r.p_W.y()) << '\t' << formatNumber(r.p_W.z()) << '\t' << escaped(cell) << '\t'
                << r.segment.segment << '\t' << sample << '\t' << (r.exact ? "true" : "false") << '\t' << r.tiles_read;
      if (along) std::cout << '\t' << formatNumber(*along);
      std::cout << '\n';
    }
  }
  void end() {
    begin();
    if (json_) std::cout << "\n]\n";
  }

 private:
  // Not in the constructor, so that a refused query prints no header.
  void begin() {
    if (begun_) return;
    begun_ = true;
    if (json_)
      std::cout << '[';
    else
      std::cout << "query\trank\tdistance\tx\ty\tz\tcell\tsegment\tsample\texact\ttiles_read"
                << (along_ ? "\talong\n" : "\n");
  }

  const TileSet& set_;
  bool json_, along_, begun_ = false;
  const char* separator_ = "\n";
  std::map<std::uint32_t, std::vector<std::int64_t>> sample_ids_;  // by cell: the child's id, by segment
};

std::vector<Vector3d> pointsOf(const NearestArguments& a) {
  if (int{!a.points.empty()} + int{!a.coordinates.empty()} + int{!a.box.empty()} + int{!a.ray.empty()} != 1)
    throw UsageError("nearest: give one of: a point X Y Z, --points FILE (- for stdin), --box, --ray");
  if (!a.coordinates.empty())
    return {Vector3d(parseNumber("X", a.coordinates[0]), parseNumber("Y", a.coordinates[1]),
                     parseNumber("Z", a.coordinates[2]))};
  if (a.points.empty()) return {};  // a box or a ray
  if (a.points == "-") return readPoints(std::cin, "stdin");
  std::ifstream file(a.points);
  if (!file) throw IoError(escaped(a.points), "cannot open", errno);
  return readPoints(file, escaped(a.points));
}

int runNearest(const NearestArguments& a) {
  const std::vector<Vector3d> points = pointsOf(a);
  const auto set = TileSet::open(a.set, a.remote->options());
  const Nearest nearest(*set, {.engine = a.engine, .budget_bytes = parseBytes("--budget", a.budget)});
  NearestQuery query{.k = a.k, .epsilon = a.epsilon, .approximate = a.approximate};
  if (a.radius >= 0) {
    query.max_distance_um = a.radius;
    if (!a.k_given) query.k = SIZE_MAX;
  }

  Rows rows(*set, a.json, !a.ray.empty());
  if (!a.box.empty()) {
    const std::vector<double> c = numbers("--box", a.box);
    for (const NearestResult& r : nearest.inBox({c[0], c[1], c[2]}, {c[3], c[4], c[5]})) rows.write(0, r);
  } else if (!a.ray.empty()) {
    const std::vector<double> c = numbers("--ray", a.ray);
    const RayQuery ray{.origin_W = {c[0], c[1], c[2]},
                       .direction = {c[3], c[4], c[5]},
                       .radius_um = a.tolerance,
                       .slope = a.slope,
                       .most = a.k};
    std::uint32_t rank = 0;
    for (const RayHit& hit : nearest.alongRay(ray)) {
      const NearestResult r{rank++, hit.distance_um, hit.p_W,           hit.segment, hit.t, hit.tile,
                            true,   hit.tiles_read,  hit.tiles_searched};
      rows.write(0, r, hit.along_um);
    }
  } else {
    for (std::size_t begin = 0; begin < points.size(); begin += kBatch) {
      throwIfInterrupted();
      const auto batch = std::span(points).subspan(begin, std::min(kBatch, points.size() - begin));
      std::size_t i = begin;
      for (const std::vector<NearestResult>& results : nearest.findAll(batch, query, a.threads)) {
        for (const NearestResult& r : results) rows.write(i, r);
        ++i;
      }
    }
  }
  rows.end();
  return 0;
}

}  // namespace

void addNearest(CLI::App& app, Chosen& chosen) {
  auto arguments = std::make_shared<NearestArguments>();
  CLI::App* command = app.add_subcommand("nearest", "Find the segments nearest to points, in a box or along a ray");
  command->footer(
      "Examples:\n  filiform nearest column.fil 12.5 -300 40 --k 3\n  filiform nearest column.fil --points soma.txt "
      "--json\n  filiform nearest column.fil --box 0 700 0 20 720 20\n"
      "  filiform nearest column.fil --ray 0 700 -500 0 0 1 --k 5");
  command->add_option("SET", arguments->set, "tile set, or its address")->required();
  command->add_option("XYZ", arguments->coordinates, "point, um")->expected(3)->type_name("X Y Z");
  command->add_option("--points", arguments->points, "read points from this file, one 'x y z' a line; - for stdin")
      ->type_name("FILE");
  CLI::Option* k = command->add_option("--k", arguments->k, "find this many segments a point; along a ray, at most")
                       ->capture_default_str()
                       ->check(CLI::Range(1, 1000000));
  command->add_option("--epsilon", arguments->epsilon, "allow distances up to (1 + E) times the nearest")
      ->type_name("E")
      ->capture_default_str();
  command->add_flag("--approximate", arguments->approximate, "answer from the set's landmarks, without reading a tile");
  command->add_option("--engine", arguments->engine, "search a tile with packed, or with cgal as a reference")
      ->capture_default_str();
  command->add_option("--budget", arguments->budget, "keep at most this memory of tiles between queries")
      ->capture_default_str()
      ->type_name("BYTES");
  command->add_option("--radius", arguments->radius, "find only segments within R um; all of them without --k")
      ->type_name("R")
      ->check(CLI::NonNegativeNumber);
  command->add_option("--box", arguments->box, "find all segments that meet a box, um; nearest to its middle first")
      ->expected(6)
      ->type_name("X0 Y0 Z0 X1 Y1 Z1");
  command->add_option("--ray", arguments->ray, "find segments near a ray: origin, direction; sorted along the ray")
      ->expected(6)
      ->type_name("X Y Z DX DY DZ");
  command->add_option("--tolerance", arguments->tolerance, "largest distance from the ray, um")
      ->capture_default_str()
      ->check(CLI::NonNegativeNumber);
  command->add_option("--slope", arguments->slope, "increase of the tolerance for each um along the ray")
      ->capture_default_str()
      ->check(CLI::NonNegativeNumber);
  command->add_option("--threads", arguments->threads, "use N threads for many points")
      ->capture_default_str()
      ->check(CLI::Range(1, 1024));
  command->add_flag("--json", arguments->json, "write one JSON array");
  command->add_flag("--tsv", arguments->tsv, "write tab-separated rows (the default)")->excludes("--json");
  arguments->remote = addRemoteArguments(*command);
  command->callback([arguments, k, &chosen] {
    arguments->k_given = k->count() > 0;
    chosen = [arguments] { return runNearest(*arguments); };
  });
}

}  // namespace filiform::tools
