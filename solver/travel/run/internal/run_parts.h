// The parts of a headless run that both clocks use: device, tiles, navigation, legs, time and figures. Thread rule:
// owned by the thread of run(). While a haptic thread runs, only that thread uses the parts of a tick: device, hand,
// legs, time and statistics.
#pragma once

#include "index/set/tile_store.h"
#include "solver/travel/hand/internal/hand_navigation.h"
#include "solver/travel/hand/internal/hand_tiles.h"
#include "solver/travel/hand/internal/navigation_choice.h"
#include "solver/travel/hand/internal/travel_device.h"
#include "solver/travel/run/internal/itinerary.h"
#include "solver/travel/run/internal/leg_travel.h"
#include "solver/travel/run/internal/run_statistics.h"
#include "solver/travel/run/internal/run_time.h"
#include "solver/travel/run/run_options.h"
#include "solver/travel/run/run_summary.h"
#include "solver/travel/run/tick_row.h"

#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace filiform::internal {

using OnTick = std::function<void(const TickRow&)>;

struct RunParts {
  // Plans the first leg, creates the device and opens the recording. The store must outlive the object. Throws as run()
  // does.
  RunParts(const TileStore& scene, const RunOptions& wanted);
  RunParts(const RunParts&) = delete;
  RunParts& operator=(const RunParts&) = delete;

  // Puts the first point of the first leg under the hand. Requires an open device. Throws UsageError for a damaged set.
  void placeAtStart();
  // After a tick: fills its row, updates the figures and the point to which the person pulls the hand. Returns true
  // when the run is over. Haptic-safe.
  bool account(const NavigationTick& tick, TickRow& row) noexcept;
  bool isToldToStop() const noexcept {
    return options.stop != nullptr && options.stop->load(std::memory_order_relaxed);
  }
  // After the last tick. O(tiles + cells).
  RunSummary summary() const;
  // Ends the run after its last tick: writes the recording, or keeps it aside if the run was interrupted, and calls
  // RunOptions::ending. Throws what writing throws.
  void end();
  // Instead of end(), or after it has thrown: keeps the recording aside and calls `ending` with the error.
  void fail(const std::exception_ptr& error) noexcept;

  const TileStore& store;
  const RunOptions options;
  RunTime time;
  Itinerary itinerary;
  std::unique_ptr<Leg> first;  // moved into `legs` by the constructor
  const std::uint32_t first_cell;
  TravelDevice device;
  HandTiles tiles;
  RunStatistics statistics;
  NavigationChoice choice;
  std::optional<HandNavigation> hand;
  std::optional<LegTravel> legs;
  double most_periods = 0;  // time limit

  bool was_interrupted = false;
  std::optional<std::uint64_t> missed_deadlines;  // real time only
  std::optional<LoopReport> loop;                 // real time only
  std::vector<std::string> notes;                 // for RunSummary
  bool ended = false;                             // by end() or fail()

 private:
  void keepRecording() noexcept;
  void record();
  void check() const;
  void noteStability();
  RunOutcome outcome() const;
  void addNotes(RunSummary& summary) const;
};

}  // namespace filiform::internal
