// Races engines that find the nearest segment, over the same segments in one process: build time, memory, query time,
// equal results. Thread rule: functions without state; an OwnEngine is used by one thread.
#pragma once

#include "index/query/nearest.h"
#include "index/set/tile_store.h"
#include "index/tile/tile_engine.h"
#include "tools/lab/bench/peers.h"

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace filiform::tools {

struct JumpEngine {
  std::string name;
  SquaredDistance squared;
  double build_s = 0;
  // Bytes a segment of everything that a query needs: growth of the process' resident memory after freed memory was
  // returned to the system. Measured in the same way for all engines.
  double bytes = 0;
};

// filiform's engine: tiles in memory, all loaded and searched once. Must outlive its engine().
class OwnEngine {
 public:
  // `segments`: the number of segments that the stream gives.
  OwnEngine(CellStream& cells, std::uint64_t segments);
  const TileStore& store() const { return *store_; }
  const Nearest& nearest() const { return *nearest_; }
  const JumpEngine& engine() const { return engine_; }

 private:
  std::unique_ptr<TileStore> store_;
  std::unique_ptr<Nearest> nearest_;
  JumpEngine engine_;
};

// filiform's tree in one piece over all segments, searched directly: what tiles cost nothing against. Must outlive its
// engine().
class WholeEngine {
 public:
  WholeEngine(CellStream& cells, std::uint64_t segments);
  const JumpEngine& engine() const { return engine_; }

 private:
  std::vector<std::unique_ptr<TileEngine>> trees_;  // of the one tile, and of the long-segment tile if there is one
  JumpEngine engine_;
};

// Every segment of the store once, in the form that peers take.
std::vector<SegmentEnds> ownedEnds(const TileStore& store);

// Builds the engine of a setting. The segments must outlive the engine.
JumpEngine builtEngine(const std::string& name, const PeerSetting& setting, const std::vector<SegmentEnds>& segments);

// Returns `count` points. "near": 0.5 um (sigma, each axis) about a node. "uniform": in the cube [0, side_um]^3. "far":
// outside the cube, within one side of it.
std::vector<Vector3d> pointsOf(const TileStore& store, const std::string& where, std::size_t count, double side_um,
                               std::uint64_t seed);

struct Raced {
  std::vector<double> ns;  // CPU time of a jump, by batch
  double p99_ns = 0;       // of single jumps, by the clock, including the reading of the clock
  double recall = 0;       // fraction of correct results
};

// Wall time of a point, ns, by batch: for one call of find() a point, in the given order, and for findAll() on one and
// on two threads, in turn.
struct RacedBatches {
  std::vector<double> single, one_thread, two_threads;
};
RacedBatches raceBatches(const Nearest& nearest, const std::vector<Vector3d>& points);

// Runs kBatches batches, the engines in turn, and then each jump alone for the 99th percentile. Throws
// std::runtime_error if an engine differs from the first one by more than 1e-6 um.
std::vector<Raced> raceJumps(const std::vector<JumpEngine>& engines, const std::vector<Vector3d>& points);

}  // namespace filiform::tools
