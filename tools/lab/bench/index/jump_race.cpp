#include "tools/lab/bench/index/jump_race.h"

#include "index/ingest/memory_tiles.h"
#include "tools/lab/bench/bench.h"
#include "tools/lab/bench/trade.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <limits>
#include <malloc.h>
#include <random>
#include <stdexcept>
#include <unistd.h>

namespace filiform::tools {

namespace {

constexpr double kSameJump_um = 1e-6;
using RaceClock = std::chrono::steady_clock;

double residentBytes() {
  malloc_trim(0);  // freed memory must not count for an engine
  std::ifstream file("/proc/self/statm");
  double all = 0, resident = 0;
  file >> all >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE));
}

}  // namespace

OwnEngine::OwnEngine(CellStream& cells, std::uint64_t segments) {
  const double before = residentBytes(), from = threadTime_s();
  store_ = buildTilesInMemory(cells);
  nearest_ = std::make_unique<Nearest>(*store_, NearestOptions{.budget_bytes = UINT64_MAX});
  for (TileId id = 0; id < store_->tile_count(); ++id) nearest_->find(store_->load(id)->position_W(0));
  engine_.name = "filiform";
  engine_.build_s = threadTime_s() - from;
  engine_.bytes = (residentBytes() - before) / static_cast<double>(segments);
  engine_.squared = [this, found = std::vector<NearestResult>()](const Vector3d& h_W) mutable {
    nearest_->find(h_W, {}, found);
    const double d = found[0].distance_um;
    return d * d;
  };
}

WholeEngine::WholeEngine(CellStream& cells, std::uint64_t segments) {
  const double before = residentBytes(), from = threadTime_s();
  {
    const auto store = buildTilesInMemory(cells, {.capacity = UINT32_MAX});
    for (TileId id = 0; id < store->tile_count(); ++id)
      trees_.push_back(makeTileEngine(TileEngineKind::packed, store->load(id)));
  }
  engine_.name = "whole";
  engine_.build_s = threadTime_s() - from;
  engine_.bytes = (residentBytes() - before) / static_cast<double>(segments);
  engine_.squared = [this](const Vector3d& h_W) {
    Candidates best(1, 0, std::numeric_limits<double>::infinity());
    for (const auto& tree : trees_) tree->search(h_W, best);
    return best.bound2();
  };
}

std::vector<SegmentEnds> ownedEnds(const TileStore& store) {
  std::vector<SegmentEnds> ends;
  for (TileId id = 0; id < store.tile_count(); ++id) {
    const auto tile = store.load(id);
    for (std::uint32_t s = 0; s < tile->segment_count(); ++s)
      if (tile->owned(s)) ends.push_back({tile->position_W(tile->child(s)), tile->position_W(tile->parent(s))});
  }
  return ends;
}

JumpEngine builtEngine(const std::string& name, const PeerSetting& setting, const std::vector<SegmentEnds>& segments) {
  JumpEngine engine{name, {}};
  const double before = residentBytes(), from = threadTime_s();
  const auto start = RaceClock::now();
  engine.squared = setting.build(segments);
  // Embree builds on its own threads, so the clock is needed too.
  engine.build_s = std::max(threadTime_s() - from, std::chrono::duration<double>(RaceClock::now() - start).count());
  engine.bytes = (residentBytes() - before) / static_cast<double>(segments.size());
  if (setting.keeps_segments) engine.bytes += sizeof(SegmentEnds);
  return engine;
}

std::vector<Vector3d> pointsOf(const TileStore& store, const std::string& where, std::size_t count, double side_um,
                               std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> place(0, side_um), around(-side_um, 2 * side_um);
  std::normal_distribution<double> jitter(0, 0.5);
  std::vector<Vector3d> points;
  while (points.size() < count) {
    if (where == "near") {
      const auto tile = store.load(static_cast<TileId>(random() % store.tile_count()));
      if (tile->node_count() == 0) continue;
      points.push_back(tile->position_W(static_cast<std::uint32_t>(random() % tile->node_count())) +
                       Vector3d(jitter(random), jitter(random), jitter(random)));
    } else if (where == "uniform") {
      points.emplace_back(place(random), place(random), place(random));
    } else {
      const Vector3d h_W(around(random), around(random), around(random));
      if ((h_W.array() < 0).any() || (h_W.array() > side_um).any()) points.push_back(h_W);
    }
  }
  return points;
}

std::vector<Raced> raceJumps(const std::vector<JumpEngine>& engines, const std::vector<Vector3d>& points) {
  std::vector<double> expected, found(points.size());
  std::vector<Raced> all(engines.size());
  for (const Vector3d& h_W : points) expected.push_back(std::sqrt(engines[0].squared(h_W)));  // also warms the caches
  for (int batch = 0; batch < kBatches; ++batch)
    for (std::size_t e = 0; e < engines.size(); ++e) {
      const double from = threadTime_s();
      for (std::size_t i = 0; i < points.size(); ++i) found[i] = engines[e].squared(points[i]);
      all[e].ns.push_back(1e9 * (threadTime_s() - from) / static_cast<double>(points.size()));
      for (std::size_t i = 0; batch == 0 && i < points.size(); ++i) {
        const double off_um = std::abs(std::sqrt(found[i]) - expected[i]);
        if (!(off_um <= kSameJump_um))
          throw std::runtime_error(engines[e].name + " answers otherwise than " + engines[0].name);
        all[e].recall += 1.0 / static_cast<double>(points.size());
      }
    }
  for (std::size_t e = 0; e < engines.size(); ++e) {
    std::vector<double> single;
    for (const Vector3d& h_W : points) {
      const auto start = RaceClock::now();
      found[0] = engines[e].squared(h_W);
      single.push_back(std::chrono::duration<double, std::nano>(RaceClock::now() - start).count());
    }
    all[e].p99_ns = percentile(single, 0.99);
  }
  return all;
}

RacedBatches raceBatches(const Nearest& nearest, const std::vector<Vector3d>& points) {
  RacedBatches raced;
  std::vector<NearestResult> found;
  const auto timed = [&](std::vector<double>& ns, const auto& work) {
    const auto start = RaceClock::now();
    work();
    const std::chrono::duration<double, std::nano> passed = RaceClock::now() - start;
    ns.push_back(passed.count() / static_cast<double>(points.size()));
  };
  for (int batch = 0; batch < kBatches; ++batch) {
    timed(raced.single, [&] {
      for (const Vector3d& h_W : points) nearest.find(h_W, {}, found);
    });
    timed(raced.one_thread, [&] { nearest.findAll(points, {}, 1); });
    timed(raced.two_threads, [&] { nearest.findAll(points, {}, 2); });
  }
  return raced;
}

}  // namespace filiform::tools
