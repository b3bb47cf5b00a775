// The hand's travel along the legs of a run: the current leg, its end, the jump to the next leg, and the point to which
// the simulated person pulls the hand.
//
//   legs.begin(h_D);
//   if (legs.wantsNext()) legs.setNext(itinerary.next());  // before a tick
//   legs.moveOn(state, time);
//   ...tick...
//   time.pass();
//   legs.update(time);                                     // after the tick
//
// Thread rule: haptic thread. All members except the constructor, awaitFirst() and moveOnAsRecorded() are
// haptic-safe.
#pragma once

#include "index/streaming/residency.h"
#include "solver/loop/loop_metrics.h"
#include "solver/travel/hand/internal/hand_navigation.h"
#include "solver/travel/run/internal/itinerary.h"
#include "solver/travel/run/internal/run_time.h"

#include <cstdint>
#include <functional>
#include <memory>

namespace filiform::internal {

class LegTravel {
 public:
  struct Counts {
    std::uint64_t begun = 0, completed = 0, dropped = 0;
    std::uint64_t jumps = 0, jump_wait_ticks = 0;
  };
  struct Totals {  // sums over all legs so far
    double route_um = 0, reached_um = 0;
    int back_offs = 0;
  };

  // All arguments except `first` must outlive the object.
  LegTravel(const RunOptions& options, Itinerary& itinerary, std::unique_ptr<Leg> first, HandTiles& tiles,
            TravelDevice& device, HandNavigation& hand);

  const Leg& leg() const noexcept { return *leg_; }
  // Puts the first point of the first leg under the hand (h_D: m, frame D). Requires its tile to be present. Returns
  // false if the tile does not have the route's first segment.
  bool begin(const Vector3d& h_D, const RunTime& time) noexcept { return enter(*leg_, h_D, time); }

  // The leg is over, and the next leg is not known yet.
  bool wantsNext() const noexcept { return leg_over_ && !past_ && !next_; }
  // Takes ownership of the next leg; nullptr: no leg is planned yet.
  void setNext(Leg* next) noexcept { next_.reset(next); }
  // Before each tick. If the leg is over: jumps to the next leg when its tiles are in memory, or drops the next leg if
  // they do not come. The old leg stays in past() until the caller frees it; until then there is no further jump.
  void moveOn(const DeviceState& state, const RunTime& time) noexcept;
  // Like moveOn(), for a replay: jumps when the recorded run did. Plans legs; exceptions of planning and loading
  // propagate.
  void moveOnAsRecorded(const DeviceState& state, const RunTime& time);
  std::unique_ptr<Leg>& past() noexcept { return past_; }

  // After each tick, when its time has passed: updates the proxy's progress and the point to which the hand is pulled.
  void update(const RunTime& time) noexcept;
  bool isOver() const noexcept { return leg_over_; }     // the leg is over; the hand stays until the jump
  bool hasArrived() const noexcept { return arrived_; }  // at the end of the leg

  // Navigation's focus. While a jump waits, the focus includes the target of the jump.
  ReaderFocus focus() const noexcept;
  // Before the first tick: like a jump, the first leg waits for the tiles that the hand can reach at once.
  // `let_time_pass` returns false to end the wait. Not haptic-safe.
  void awaitFirst(const std::function<bool()>& let_time_pass);
  // How long a jump waits for its tiles before its leg is dropped.
  double longestJumpWaitPeriods(const RunTime& time) const noexcept { return time.periodsOf(longest_jump_wait_s_); }

  const Counts& counts() const noexcept { return counts_; }
  const TimeHistogram& jumpWaits() const noexcept { return jump_waits_; }  // see RunSummary
  Totals totals() const noexcept;                                          // includes the current leg

 private:
  bool enter(const Leg& leg, const Vector3d& h_D, const RunTime& time) noexcept;
  void leavePast(const DeviceState& state, const RunTime& time) noexcept;
  bool hasTilesOf(const Leg& leg) const noexcept;
  void drop() noexcept;

  Itinerary& itinerary_;
  HandTiles& tiles_;
  TravelDevice& device_;
  HandNavigation& hand_;
  bool tiles_on_demand_, person_leads_;
  double arrive_m_, longest_jump_wait_s_;
  std::unique_ptr<Leg> leg_;          // the current leg
  std::unique_ptr<Leg> next_, past_;  // the leg after the next jump; the leg to be freed
  double leg_end_periods_ = 0, jump_waited_periods_ = 0;
  bool arrived_ = false, leg_over_ = false;
  Counts counts_;
  TimeHistogram jump_waits_;
  Totals past_totals_;
};

}  // namespace filiform::internal
