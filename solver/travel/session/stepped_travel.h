// A hand that travels a set one tick at a time. The caller is the device: it gives the hand's position and gets the
// force.
//
//   const NearestResult start = Nearest(*set).find(p_W).at(0);
//   SteppedTravel travel(*set);
//   travel.jump(start.tile, start.segment, start.t);
//   for (;;) force_N = travel.tick(hand_D, 0.001).wrench.force_N;
//
// Virtual time (the default): a tick reads the tiles that it needs, and waits for the disk. The result depends only on
// the data and the calls. Real time: IO threads read tiles; a tick takes those in memory, never waits, and rests at a
// frontier. In real time, the force is zero while the proxy waits for a tile that cannot be read.
//
// Thread rule: one thread at a time. tick() in real time is haptic-safe; the other members are not.
#pragma once

#include "index/set/tile_store.h"
#include "index/streaming/residency.h"
#include "solver/proxy/proxy_solver.h"
#include "solver/workspace/navigation.h"

#include <cstdint>
#include <memory>
#include <optional>

namespace filiform {

// How the hand travels, and how tiles are read.
struct SteppedTravelOptions {
  bool realtime = false;
  SolverMethod method = SolverMethod::climb;
  double zoom_um = 300;                            // world across 0.12 m of device
  double rate_Hz = 1000;                           // of ticks, for the choice of the passivity controller
  double stiffness_N_m = 200;                      // of the spring
  double max_force_N = 8;                          // of the force on the hand
  std::optional<std::uint64_t> budget_bytes = {};  // of decoded tiles; none: unlimited
};

class SteppedTravel {
 public:
  // The proxy has no place before the first jump. The store must outlive the object. Throws UsageError for a budget
  // below the minimum or an option out of range; CorruptTile and IoError from the store.
  explicit SteppedTravel(const TileStore& store, const SteppedTravelOptions& options = {});
  ~SteppedTravel();
  SteppedTravel(const SteppedTravel&) = delete;
  SteppedTravel& operator=(const SteppedTravel&) = delete;

  // Moves the proxy to a place of a segment, t in 0 (child) .. 1 (parent). `tile` stores the segment, as a
  // NearestResult says. The world moves so that the place lies under the hand of the last tick. The old force fades,
  // and the new one grows over ForceLawOptions::ramp_s. Reads the tile; in another cell, a
  // force-based method reads all tiles of the cell. Throws UsageError if the tile does not store the segment or if t is
  // NaN; CorruptTile, IoError.
  void jump(TileId tile, SegmentId segment, double t);
  // Changes the view between ticks: zoom, rotate, centre, free. Returns false for a value that is not finite. Jumps go
  // through jump().
  bool apply(const NavigationCommand& command) noexcept;

  // One tick: the hand is at hand_D (m), dt_s after the last tick. The result is valid until the next call. Throws
  // UsageError unless dt_s is > 0 and finite; in virtual time CorruptTile and IoError for a tile that cannot be read.
  // The force is then zero, and the next tick tries again.
  const NavigationTick& tick(const Vector3d& hand_D, double dt_s);

  const ProxyPlace& place() const noexcept;
  // Counters of the tiles. Not haptic-safe.
  ResidencyCounters residency() const;
  std::uint64_t budget_bytes() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform
