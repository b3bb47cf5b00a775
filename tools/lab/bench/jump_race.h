// Engines that answer exact jumps over the same segments, raced in one process: building, memory, time, equal answers.
// Thread rule: functions without state; an OwnEngine is used by one thread.
#pragma once

#include "index/query/nearest.h"
#include "index/set/tile_store.h"
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
  // A segment, of all that answers need: by the growth of the process' resident memory after freed memory was given
  // back to the system. The same ruler for all engines.
  double bytes = 0;
};

// filiform's own: tiles in memory, every one loaded and met by a query. Outlives its engine().
class OwnEngine {
 public:
  // `segments`: as many as the stream gives.
  OwnEngine(CellStream& cells, std::uint64_t segments);
  const TileStore& store() const { return *store_; }
  const Nearest& nearest() const { return *nearest_; }
  const JumpEngine& engine() const { return engine_; }

 private:
  std::unique_ptr<TileStore> store_;
  std::unique_ptr<Nearest> nearest_;
  JumpEngine engine_;
};

// Every segment of the store once, as peers take them.
std::vector<SegmentEnds> ownedEnds(const TileStore& store);

// The segments must outlive the engine.
JumpEngine builtEngine(const std::string& name, const PeerSetting& setting, const std::vector<SegmentEnds>& segments);

// `count` points: "near" is 0.5 um (sigma, each axis) about a node, "uniform" in the cube [0, side_um]^3, "far" outside
// it, within one side about it.
std::vector<Vector3d> pointsOf(const TileStore& store, const std::string& where, std::size_t count, double side_um,
                               std::uint64_t seed);

struct Raced {
  std::vector<double> ns;  // CPU time of a jump, by batch
  double p99_ns = 0;       // of single jumps by the clock, reading it included
  double recall = 0;       // share of right answers
};

// kBatches batches, the engines in turn; then each jump by itself for the tail. Throws std::runtime_error if an engine
// differs from the first one by more than 1e-6 um.
std::vector<Raced> raceJumps(const std::vector<JumpEngine>& engines, const std::vector<Vector3d>& points);

}  // namespace filiform::tools
