// The hand's way along the legs of a run: which leg it travels, when a leg is over, the jump to the next one, and where
// the simulated person leads the hand.
//
//   legs.begin(h_D);
//   if (legs.wantsNext()) legs.setNext(itinerary.next());  // before a tick
//   legs.moveOn(state, time);
//   ...tick...
//   time.pass();
//   legs.follow(time);                                     // after it
//
// Thread rule: haptic thread; haptic-safe but for the constructor and moveOnAsRecorded().
#pragma once

#include "index/streaming/residency.h"
#include "solver/travel/internal/hand_navigation.h"
#include "solver/travel/internal/itinerary.h"
#include "solver/travel/internal/run_time.h"

#include <cstdint>
#include <memory>

namespace filiform::internal {

class LegTravel {
 public:
  struct Counts {
    std::uint64_t begun = 0, completed = 0, dropped = 0;
    std::uint64_t jumps = 0, jump_wait_ticks = 0;
  };
  struct Totals {  // over all legs so far
    double route_um = 0, reached_um = 0;
    int back_offs = 0;
  };

  // All but `first` must outlive it. `leads`: the person of a leg decides where the hand pulls to and when a leg is
  // given up.
  LegTravel(const RunOptions& options, Itinerary& itinerary, std::unique_ptr<Leg> first, HandTiles& tiles,
            TravelDevice& device, HandNavigation& hand);

  const Leg& leg() const noexcept { return *leg_; }
  // Puts the first point of the first leg under the hand (m, frame D). Requires its tile to be present. False if the
  // tile does not have the route's first segment.
  bool begin(const Vector3d& h_D, const RunTime& time) noexcept { return enter(*leg_, h_D, time); }

  // The leg is over and the next one is not known yet.
  bool wantsNext() const noexcept { return leg_over_ && !past_ && !next_; }
  // Takes the leg over; nullptr: none is planned yet.
  void setNext(Leg* next) noexcept { next_.reset(next); }
  // Before each tick. If the leg is over: jumps to the next one once its tiles have come, or gives it up when they do
  // not come. The leg that is left waits in past() to be freed; until then nothing moves on.
  void moveOn(const DeviceState& state, const RunTime& time) noexcept;
  // The same in a replay: moves on when the recorded run did. Plans legs; throws what that and loading tiles throws.
  void moveOnAsRecorded(const DeviceState& state, const RunTime& time);
  std::unique_ptr<Leg>& past() noexcept { return past_; }

  // After each tick, when its time has passed: how far the proxy has come, and where the person leads the hand next.
  void follow(const RunTime& time) noexcept;
  bool isOver() const noexcept { return leg_over_; }     // the leg; the hand stays where it is until the jump
  bool hasArrived() const noexcept { return arrived_; }  // at the end of the leg

  // Navigation's focus; while a jump waits, with its target.
  ReaderFocus focus() const noexcept;
  // The focus before the first leg begins: as a jump to it.
  ReaderFocus startFocus() const noexcept;
  // How long a jump waits for its tiles before its leg is given up.
  double patiencePeriods(const RunTime& time) const noexcept { return time.periodsOf(jump_patience_s_); }

  const Counts& counts() const noexcept { return counts_; }
  Totals totals() const noexcept;  // with the leg under way

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
  double arrive_m_, jump_patience_s_;
  std::unique_ptr<Leg> leg_;          // being travelled
  std::unique_ptr<Leg> next_, past_;  // to jump to, and to be freed
  double leg_end_periods_ = 0, jump_waited_periods_ = 0;
  bool arrived_ = false, leg_over_ = false;
  Counts counts_;
  Totals past_totals_;
};

}  // namespace filiform::internal
