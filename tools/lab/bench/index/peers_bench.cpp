// bench peers: races the settings of every peer over the same segments. `bench nearest` races the best of them.
#include "tools/lab/bench/index/dense_cells.h"
#include "tools/lab/bench/index/jump_race.h"
#include "tools/lab/bench/trade.h"
#include "tools/lab/bench/workloads.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>

namespace filiform::tools {

namespace {

const char* const kJumpPlaces[] = {"near", "uniform", "far"};

// A setting and its times.
struct Searched {
  std::string setting;
  std::vector<std::vector<double>> ns;  // by place, by batch
  double build_s = 0, bytes = 0;
  // The geometric mean, over the places, of its median divided by filiform's median in the same batches.
  double times = 0;
};

// filiform is the first engine. The results of every peer are compared with filiform's.
std::vector<Searched> searched(const std::vector<JumpEngine>& engines,
                               const std::vector<std::vector<Vector3d>>& points) {
  std::vector<Searched> all;
  for (const JumpEngine& engine : engines) all.push_back({engine.name, {}, engine.build_s, engine.bytes, 1});
  all.front().setting = "filiform, in the same batches";
  for (const std::vector<Vector3d>& of_place : points) {
    const std::vector<Raced> raced = raceJumps(engines, of_place);
    const double own_ns = median(raced[0].ns);
    for (std::size_t e = 0; e < engines.size(); ++e) {
      all[e].ns.push_back(raced[e].ns);
      all[e].times *= std::pow(median(raced[e].ns) / own_ns, 1.0 / static_cast<double>(points.size()));
    }
  }
  return all;
}

BenchReport runPeers(const BenchOptions& options) {
  BenchReport report;
  const std::uint64_t size = options.segments != 0 ? options.segments
                             : options.quick       ? 5'000
                             : options.long_run    ? 1'000'000
                                                   : 300'000;
  const std::vector<Cell> library = morphologyLibrary(options.corpus, options.quick ? 4 : 60, options.seed);
  options.progress("tiles of " + std::to_string(size) + " segments");
  DenseCells cells(library, size, kPerUm3, options.seed);
  const OwnEngine own(cells, size);
  const std::vector<SegmentEnds> ends = ownedEnds(own.store());
  std::vector<std::vector<Vector3d>> points;
  for (const char* where : kJumpPlaces)
    points.push_back(pointsOf(own.store(), where, options.quick ? 50 : 1000, cells.side_um(), options.seed + 1));

  BenchTable table{
      "settings",
      std::to_string(size) + " segments at 0.67 a um^3, all in memory. Exact jumps: ns of CPU, median of " +
          std::to_string(kBatches) + " batches of " + std::to_string(points[0].size()) +
          " points with the least and the most, the settings of a peer in turn; times: geometric mean over "
          "near, uniform and far of the time over filiform's in the same batches; s to build; bytes a "
          "segment of all that answers need, by the growth of resident memory",
      {"peer", "setting", "near ns", "near least", "near most", "uniform ns", "uniform least", "uniform most", "far ns",
       "far least", "far most", "times", "build s", "bytes", "raced"},
      {},
      {"peer", "setting"}};
  for (const Peer& peer : peers()) {
    if (!peer.inBuild()) {
      report.notes.push_back(peer.name +
                             " is not in this build (tools/setup --bench, then configure and build again).");
      continue;
    }
    report.versions.emplace_back(peer.name, peer.version);
    std::vector<JumpEngine> engines{own.engine()};
    for (const PeerSetting& setting : peer.settings) {
      options.progress(peer.name + ", " + setting.name);
      engines.push_back(builtEngine(setting.name, setting, ends));
    }
    options.progress("jumps of " + peer.name);
    const std::vector<Searched> all = searched(engines, points);
    for (std::size_t i = 0; i < all.size(); ++i) {
      const Searched& one = all[i];
      std::vector<BenchValue> row{peer.name, one.setting};
      for (std::size_t place = 0; place < points.size(); ++place) {
        for (const double part : {0.5, 0.0, 1.0}) row.emplace_back(percentile(one.ns[place], part));
        report.samples.push_back({table.name,
                                  {peer.name, one.setting},
                                  std::string(kJumpPlaces[place]) + " ns",
                                  "ns",
                                  false,
                                  one.ns[place]});
      }
      row.insert(row.end(), {one.times, one.build_s, one.bytes, std::string(i == peer.raced + 1 ? "raced" : "")});
      table.rows.push_back(std::move(row));
    }
    const auto best = std::min_element(std::next(all.begin()), all.end(),
                                       [](const Searched& a, const Searched& b) { return a.times < b.times; });
    const double part = all[peer.raced + 1].times / best->times;
    report.goals.push_back({peer.name + ": time of the raced setting (" + peer.best().name +
                                ") over that of the best (" + best->setting + ")",
                            "<= 1.1", "<= 1.03", part, part <= 1.1, part <= 1.03});
  }
  report.tables.push_back(std::move(table));
  report.notes.push_back(options.corpus.empty() ? "Synthetic neurons; --corpus DIR takes real ones."
                                                : std::to_string(library.size()) + " real reconstructions.");
  report.notes.push_back(
      "Every answer of every setting was compared with filiform's. The places are those of `bench nearest`.");
  return report;
}

}  // namespace

void addPeersWorkloads(std::vector<Workload>& all) {
  all.push_back({"peers", "the settings of each peer: which one `nearest` must race", runPeers});
}

}  // namespace filiform::tools
