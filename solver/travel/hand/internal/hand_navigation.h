// Navigation of a hand on a tile set: computes ticks, loads the tiles that a tick needs, and writes the marks of the
// recording. All runs and sessions, in virtual and in real time, compute their ticks here.
//
// Three kinds of tick differ only in the tiles that are present:
//   tick()              the tiles in memory now; haptic-safe
//   tickWithItsTiles()  virtual time: loads the needed tiles and repeats the tick until no tile is absent
//   tickAsRecorded()    replay: like tickWithItsTiles(), but the tiles that the recorded tick met absent stay absent
// A period, in order: exchange; a tick; publish(); pass on the wrench; prepare().
//
// Thread rule: haptic thread only (in virtual time: the caller's thread). waitsForFailedTile(): any thread.
#pragma once

#include "index/set/tile_store.h"
#include "solver/graph/graph_view.h"
#include "solver/travel/hand/internal/hand_tiles.h"
#include "solver/travel/hand/internal/travel_device.h"
#include "solver/workspace/navigation.h"

#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

namespace filiform::internal {

class HandNavigation {
 public:
  // Store, tiles and device must outlive the object. Throws as Navigation does.
  HandNavigation(const TileStore& store, HandTiles& tiles, TravelDevice& device, std::unique_ptr<ProxySolver> solver,
                 const NavigationOptions& options);

  const GraphView& graph() const noexcept { return graph_; }
  Navigation& navigation() noexcept { return navigation_; }
  const Navigation& navigation() const noexcept { return navigation_; }

  // One tick over `step_s`. Writes its marks to the recording. The result is valid until the next tick.
  const NavigationTick& tick(const DeviceState& state, double step_s) noexcept;
  // Like tick(). If the tiles of the tick do not fit the budget together, the tick is a frontier. Throws CorruptTile or
  // IoError for a tile that cannot be read.
  const NavigationTick& tickWithItsTiles(const DeviceState& state, double step_s);
  // Like tickWithItsTiles(). Requires a replay.
  const NavigationTick& tickAsRecorded(const DeviceState& state, double step_s);

  // Says whether the following time steps are measured rather than equal to the period. Stored in the marks.
  void setMeasured(bool is_measured) noexcept { step_mark_ = is_measured ? MarkBits::kMeasured : 0; }
  // Adds bits to the marks of the next tick.
  void addMarks(std::uint32_t bits) noexcept { marks_.bits |= bits; }
  // After a tick: requests the tiles that it met absent, and publishes the hand's focus to the loader. Haptic-safe.
  void publish(const ReaderFocus& focus) noexcept;
  // Prepares the next ticks. Call once a period after passing on the wrench, with the time (s) until the next exchange.
  // Haptic-safe.
  void prepare(double free_s) noexcept;

  // The proxy rests at a tile that cannot be read; the force should then be zero. Any thread.
  bool waitsForFailedTile() const;

  std::uint64_t stalls() const noexcept { return stalls_; }  // number of ticks that were repeated with more tiles
  // Number of replayed ticks that met more absent tiles than their marks can store.
  std::uint64_t uncertain_ticks() const noexcept { return uncertain_ticks_; }

 private:
  const NavigationTick& solve(const DeviceState& state, double step_s) noexcept;
  const NavigationTick& solveWithItsTiles(const DeviceState& state, double step_s);
  const NavigationTick& writeMarks(const NavigationTick& tick) noexcept;
  bool loadTilesOf(const NavigationTick& tick);

  HandTiles& tiles_;
  TravelDevice& device_;
  GraphView graph_;
  Navigation navigation_;
  const NavigationTick* last_ = nullptr;
  RunMarks marks_;  // of the next tick
  std::uint32_t step_mark_ = 0;
  std::vector<TileId> wanted_;
  std::atomic<TileId> waited_for_{kNoTile};
  std::uint64_t stalls_ = 0, uncertain_ticks_ = 0;
};

}  // namespace filiform::internal
