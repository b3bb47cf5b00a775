// filiform nearest: finds the segments nearest to points on the command line, in a file or on stdin.
#include "index/errors.h"
#include "index/query/nearest.h"
#include "index/ranks/rank_points.h"
#include "index/set/tile_set.h"
#include "index/text.h"
#include "index/workers.h"
#include "tools/commands/commands.h"
#include "tools/commands/shared/filter_arguments.h"
#include "tools/commands/shared/nearest_rows.h"
#include "tools/commands/shared/point_file.h"
#include "tools/commands/shared/remote_arguments.h"
#include "tools/program/interruption.h"
#include "tools/words/numbers.h"

#include <algorithm>
#include <functional>
#include <iostream>
#include <memory>
#include <span>

#include <CLI/CLI.hpp>

namespace filiform::tools {

namespace {

struct NearestArguments {
  std::shared_ptr<const RemoteArguments> remote;
  std::shared_ptr<const FilterArguments> filter;
  std::string set, points, budget = "256MiB", engine = "packed", own = "yes";
  std::vector<std::string> coordinates, box, ray;
  std::size_t k = 1;
  double epsilon = 0, radius = -1, tolerance = 1, slope = 0;
  unsigned threads = 1;
  bool k_given = false, approximate = false, of_cells = false, json = false, tsv = false;
};

std::vector<double> numbers(const std::string& option, const std::vector<std::string>& words) {
  std::vector<double> values;
  for (const std::string& word : words) values.push_back(parseNumber(option, word));
  return values;
}

std::vector<Vector3d> pointsOf(const NearestArguments& a) {
  if (int{!a.points.empty()} + int{!a.coordinates.empty()} + int{!a.box.empty()} + int{!a.ray.empty()} != 1)
    throw UsageError("nearest: give one of: a point X Y Z, --points FILE (- for stdin), --box, --ray");
  if (!a.coordinates.empty()) return {pointOfWords(a.coordinates)};
  return a.points.empty() ? std::vector<Vector3d>() : readPoints(a.points);  // none: a box or a ray
}

NearestQuery queryOf(const NearestArguments& a) {
  NearestQuery query{.k = a.k,
                     .epsilon = a.epsilon,
                     .approximate = a.approximate,
                     .of_cells = a.of_cells,
                     .other_cells = a.own == "no"};
  if (a.radius >= 0) {
    query.max_distance_um = a.radius;
    if (!a.k_given) query.k = SIZE_MAX;
  }
  return query;
}

// Number of points whose rows are held at once. Of many points, consecutive ones along the curve need the same tiles.
std::size_t batchOf(const NearestQuery& query) {
  constexpr std::size_t kRows = std::size_t{1} << 18, kLeast = 4096, kUnlimited = 65536;
  return query.k == SIZE_MAX ? kUnlimited : std::clamp(kRows / query.k, kLeast, kRows);
}

// Of a search: what finds, and what writes.
struct Search {
  const NearestArguments& a;
  const Nearest& nearest;
  NearestRowText& text;
  NearestRowWriter& writer;

  void box() const {
    const std::vector<double> c = numbers("--box", a.box);
    std::vector<NearestResult> found;
    const SearchCounts counts = nearest.inBox({c[0], c[1], c[2]}, {c[3], c[4], c[5]}, a.of_cells, found);
    const std::vector<SegmentLook> looks = text.readAhead(found);
    for (std::size_t i = 0; i < found.size(); ++i) {
      std::string row;
      text.append(row, 0, found[i], looks[i], counts.tiles_searched);
      writer.write(row);
    }
  }

  void ray() const {
    const std::vector<double> c = numbers("--ray", a.ray);
    const RayQuery ray{.origin_W = {c[0], c[1], c[2]},
                       .direction = {c[3], c[4], c[5]},
                       .radius_um = a.tolerance,
                       .slope = a.slope,
                       .most = a.k,
                       .of_cells = a.of_cells};
    std::uint32_t rank = 0;
    std::vector<RayHit> hits;
    const SearchCounts counts = nearest.alongRay(ray, hits);
    const std::vector<SegmentLook> looks = text.readAhead(hits);
    for (const RayHit& hit : hits) {
      const NearestResult r{rank, hit.distance_um, hit.p_W, hit.segment, hit.t, hit.tile, true};
      std::string row;
      text.append(row, 0, r, looks[rank++], counts.tiles_searched, hit.along_um);
      writer.write(row);
    }
  }

  // The rows of each point of a part; `first`: the number of position 0.
  std::vector<std::string> rowsOf(const PointPart& part, std::size_t first) const {
    std::vector<std::string> rows(part.points.size());
    std::vector<std::vector<NearestResult>> found(rows.size());
    std::vector<std::uint32_t> tiles(rows.size());
    const auto keep = [&](std::size_t i, std::vector<NearestResult>&& results, const SearchCounts& counts) {
      throwIfInterrupted();
      found[i] = std::move(results);
      tiles[i] = counts.tiles_searched;
    };
    nearest.forEach(part.points, queryOf(a), a.threads, keep);
    const std::vector<SegmentLook> looks = text.readAhead(found);
    std::vector<std::size_t> begin(found.size());  // of a point's looks
    for (std::size_t i = 1; i < found.size(); ++i) begin[i] = begin[i - 1] + found[i - 1].size();
    runItems(rows.size(), a.threads, [&](std::size_t i) {
      for (const NearestResult& r : found[i])
        text.append(rows[i], first + part.positions[i], r, looks[begin[i] + r.rank], tiles[i]);
      found[i] = {};
    });
    return rows;
  }

  void all(std::span<const Vector3d> points) const {
    const std::size_t batch = batchOf(queryOf(a));
    for (std::size_t begin = 0; begin < points.size(); begin += batch) {
      const auto some = points.subspan(begin, std::min(batch, points.size() - begin));
      for (const std::string& rows : rowsOf(wholePart(some), begin)) writer.write(rows);
    }
  }

  // Rank 0 has the points, and writes the rows.
  void allTogether(std::span<const Vector3d> points, const Grid& grid, RankPoints& ranks) const {
    const std::size_t count = ranks.ofFirst(points.size()), batch = batchOf(queryOf(a));
    for (std::size_t begin = 0; begin < count; begin += batch) {
      const auto some = points.subspan(std::min(begin, points.size()));
      const PointPart part = ranks.deal(grid, some.first(std::min(batch, some.size())));
      for (const std::string& rows : ranks.gather(part, rowsOf(part, begin))) writer.write(rows);
    }
  }
};

// `ranks`: processes that search together, or null. Rank 0 reads the points, and writes.
int runNearest(const NearestArguments& a, Ranks* ranks) {
  if (ranks != nullptr && a.points.empty())
    throw UsageError("nearest: ranks need --points FILE; for one point, --box and --ray, use filiform nearest");
  const bool is_first = ranks == nullptr || ranks->rank() == 0;
  const std::vector<Vector3d> points = is_first ? pointsOf(a) : std::vector<Vector3d>();
  const auto set = TileSet::open(a.set, a.remote->options());
  const Nearest nearest(*set, {.engine = tileEngineOf(a.engine),
                               .budget_bytes = parseBytes("--budget", a.budget),
                               .filter = a.filter->filter(*set, a.threads)});
  NearestRowText text(*set, nearest, a.json);
  NearestRowWriter writer(std::cout, a.json, !a.ray.empty());
  const Search search{a, nearest, text, writer};
  if (ranks != nullptr) {
    RankPoints together(*ranks);
    together.compare(escaped(a.set), set->revision());
    search.allTogether(points, set->grid(), together);
  } else if (!a.box.empty()) {
    search.box();
  } else if (!a.ray.empty()) {
    search.ray();
  } else {
    search.all(points);
  }
  if (is_first) writer.end();
  return 0;
}

using NearestRun = std::function<int(const NearestArguments& a)>;

void addNearestThat(CLI::App& app, Chosen& chosen, const NearestRun& run) {
  auto arguments = std::make_shared<NearestArguments>();
  CLI::App* command = app.add_subcommand("nearest", "Find the segments nearest to points, in a box or along a ray");
  command->footer(
      "Examples:\n  filiform nearest column.fil 12.5 -300 40 --k 3\n  filiform nearest column.fil --points soma.txt "
      "--json\n  filiform nearest column.fil --box 0 700 0 20 720 20\n"
      "  filiform nearest column.fil --ray 0 700 -500 0 0 1 --k 5\n"
      "  filiform nearest column.fil 12.5 -300 40 --cells --k 5 --type axon --not-cell CELL\n"
      "  filiform nearest column.fil --points soma.txt --own no --radius 2 --type dendrite");
  command->add_option("SET", arguments->set, "tile set, or its address")->required();
  command->add_option("XYZ", arguments->coordinates, "point, um")->expected(3)->type_name("X Y Z");
  command->add_option("--points", arguments->points, "read points from this file, one 'x y z' a line; - for stdin")
      ->type_name("FILE");
  CLI::Option* k = command->add_option("--k", arguments->k, "find this many segments a point; along a ray, at most")
                       ->capture_default_str()
                       ->check(CLI::Range(1, 1000000));
  CLI::Option* epsilon =
      command->add_option("--epsilon", arguments->epsilon, "allow distances up to (1 + E) times the nearest")
          ->type_name("E")
          ->capture_default_str();
  CLI::Option* approximate = command->add_flag("--approximate", arguments->approximate,
                                               "answer from the set's landmarks, without reading a tile");
  CLI::Option* cells =
      command->add_flag("--cells", arguments->of_cells, "find cells, each by its first segment; --k counts cells");
  arguments->filter = addFilterArguments(*command);
  CLI::Option* own =
      command
          ->add_option(
              "--own", arguments->own,
              "no: find no segments of a point's own cell, the one with the segment nearest to the point of all "
              "segments of the set; for points on neurites")
          ->type_name("WORD")
          ->capture_default_str()
          ->check(CLI::IsMember({"yes", "no"}));
  approximate->excludes(cells)->excludes(own);
  for (CLI::Option* const option : arguments->filter->options) approximate->excludes(option);
  command->add_option("--engine", arguments->engine, "search a tile with packed, or with cgal as a reference")
      ->capture_default_str();
  command->add_option("--budget", arguments->budget, "keep at most this memory of tiles between queries")
      ->capture_default_str()
      ->type_name("BYTES");
  CLI::Option* radius =
      command->add_option("--radius", arguments->radius, "find only segments within R um; all of them without --k")
          ->type_name("R")
          ->check(CLI::NonNegativeNumber);
  CLI::Option* box =
      command->add_option("--box", arguments->box, "find all segments that meet a box, um; nearest to its middle first")
          ->expected(6)
          ->type_name("X0 Y0 Z0 X1 Y1 Z1");
  CLI::Option* ray =
      command->add_option("--ray", arguments->ray, "find segments near a ray: origin, direction; sorted along the ray")
          ->expected(6)
          ->type_name("X Y Z DX DY DZ");
  for (CLI::Option* const of_points : {epsilon, approximate, radius, own}) of_points->excludes(box)->excludes(ray);
  k->excludes(box);
  command->add_option("--tolerance", arguments->tolerance, "largest distance from the ray, um")
      ->capture_default_str()
      ->needs(ray)
      ->check(CLI::NonNegativeNumber);
  command->add_option("--slope", arguments->slope, "increase of the tolerance for each um along the ray")
      ->capture_default_str()
      ->needs(ray)
      ->check(CLI::NonNegativeNumber);
  command->add_option("--threads", arguments->threads, "use N threads for many points")
      ->capture_default_str()
      ->check(CLI::Range(1, 1024));
  command->add_flag("--json", arguments->json, "write one JSON array");
  command->add_flag("--tsv", arguments->tsv, "write tab-separated rows (the default)")->excludes("--json");
  arguments->remote = addRemoteArguments(*command);
  command->callback([arguments, k, &chosen, run] {
    arguments->k_given = k->count() > 0;
    chosen = [arguments, run] { return run(*arguments); };
  });
}

}  // namespace

void addNearest(CLI::App& app, Chosen& chosen) {
  addNearestThat(app, chosen, [](const NearestArguments& a) { return runNearest(a, nullptr); });
}

void addNearestTogether(CLI::App& app, Chosen& chosen, Ranks& ranks, const Around& around) {
  addNearestThat(app, chosen, [&ranks, around](const NearestArguments& a) {
    return around([&] { return runNearest(a, ranks.count() > 1 ? &ranks : nullptr); });
  });
}

}  // namespace filiform::tools
