#include "solver/travel/run/internal/leg_travel.h"

#include <utility>

namespace filiform::internal {

namespace {

constexpr double kLongestJumpWait_s = 20;  // in addition to the latency

void add(LegTravel::Totals& totals, const Leg& leg) noexcept {
  totals.route_um += leg.route.length_um();
  totals.reached_um += leg.tracker.reached_um();
  totals.back_offs += leg.person.back_offs();
}

}  // namespace

LegTravel::LegTravel(const RunOptions& options, Itinerary& itinerary, std::unique_ptr<Leg> first, HandTiles& tiles,
                     TravelDevice& device, HandNavigation& hand)
    : itinerary_(itinerary),
      tiles_(tiles),
      device_(device),
      hand_(hand),
      tiles_on_demand_(!options.realtime && options.latency_ms == 0),
      // In a replayed tour, the person must give up at the same ticks as in the recorded run.
      person_leads_(device.isLed() || (itinerary.isTour() && device.replay() != nullptr)),
      arrive_m_(options.person.arrive_m),
      longest_jump_wait_s_(1e-3 * options.latency_ms + kLongestJumpWait_s),
      leg_(std::move(first)) {}

bool LegTravel::enter(const Leg& leg, const Vector3d& h_D, const RunTime& time) noexcept {
  NavigationCommand command;
  command.kind = NavigationCommand::Kind::jump;
  command.place = hand_.graph().placeAt(leg.home, leg.route.first_segment(), leg.route.first_t());
  command.reach = leg.reach;
  if (!hand_.navigation().apply(command, h_D)) return false;
  ++counts_.begun;
  leg_end_periods_ = time.periods() + time.periodsOf(leg.nominal_limit_s);
  arrived_ = leg_over_ = false;
  return true;
}

bool LegTravel::hasTilesOf(const Leg& leg) const noexcept {
  if (tiles_.table().find(leg.home) == nullptr) return false;
  TileReader* const reader = tiles_.reader();
  // On demand, each tick loads its tiles.
  return reader == nullptr || tiles_on_demand_ || reader->isTargetReady(leg.firstNode());
}

void LegTravel::moveOn(const DeviceState& state, const RunTime& time) noexcept {
  if (!leg_over_ || past_) return;
  if (next_) {
    if (hasTilesOf(*next_)) {
      past_.swap(leg_);
      leg_.swap(next_);
      jump_waits_.record(static_cast<std::int64_t>(1e9 * jump_waited_periods_ * time.period_s()));
      jump_waited_periods_ = 0;
      leavePast(state, time);
      return;
    }
    TileReader* const reader = tiles_.reader();
    if (reader != nullptr && tiles_.table().find(next_->home) == nullptr) reader->request(next_->home);
    jump_waited_periods_ += time.step_periods();
    if (jump_waited_periods_ > longestJumpWaitPeriods(time)) {
      past_.swap(next_);
      jump_waited_periods_ = 0;
      drop();
    }
  }
  ++counts_.jump_wait_ticks;
}

void LegTravel::drop() noexcept {
  ++counts_.dropped;
  hand_.addMarks(MarkBits::kLegDropped);
}

// Jumps from the old leg, now past_, to leg_.
void LegTravel::leavePast(const DeviceState& state, const RunTime& time) noexcept {
  hand_.addMarks(MarkBits::kJumped);
  add(past_totals_, *past_);
  if (enter(*leg_, state.p_D, time))
    ++counts_.jumps;
  else
    ++counts_.dropped;  // leg_over_ stays true: the next tick tries the next leg
}

void LegTravel::moveOnAsRecorded(const DeviceState& state, const RunTime& time) {
  const std::uint32_t bits = device_.replay()->marks().bits;
  if ((bits & (MarkBits::kJumped | MarkBits::kLegDropped)) != 0 && !next_) next_ = itinerary_.next();
  if ((bits & MarkBits::kLegDropped) != 0) {
    next_.reset();
    ++counts_.dropped;
  }
  if ((bits & MarkBits::kJumped) != 0) {
    tiles_.loadTogether({&next_->home, 1});
    past_ = std::move(leg_);
    leg_ = std::move(next_);
    leavePast(state, time);
    past_.reset();
  } else if (leg_over_) {
    ++counts_.jump_wait_ticks;
  }
}

void LegTravel::update(const RunTime& time) noexcept {
  if (leg_over_) return;
  const ProxyPlace& place = hand_.navigation().place();
  const Workspace& workspace = hand_.navigation().workspace();
  const Route::Progress progress = leg_->tracker.update(place);
  const double tolerance_um = arrive_m_ * workspace.scale_um_m();
  arrived_ = progress.on_route && progress.arc_um >= leg_->route.length_um() - tolerance_um;
  leg_over_ = arrived_;
  if (person_leads_) {
    const Vector3d target_D = leg_->person.target_D(place, workspace, time.step_s());
    device_.lead(target_D);
    leg_over_ = leg_over_ || leg_->person.status() == PersonStatus::gave_up;
  }
  counts_.completed += arrived_;
  if (itinerary_.isTour()) leg_over_ = leg_over_ || time.periods() >= leg_end_periods_;
}

ReaderFocus LegTravel::focus() const noexcept {
  ReaderFocus focus = hand_.navigation().focus();
  if (leg_over_ && next_) {
    focus.target_tile = next_->home;
    focus.target_node = next_->firstNode();
    focus.target_W = next_->first().p_W;
  }
  return focus;
}

void LegTravel::awaitFirst(const std::function<bool()>& let_time_pass) {
  ReaderFocus start = hand_.navigation().focus();
  start.target_tile = leg_->home;
  start.target_node = leg_->firstNode();
  start.target_W = leg_->first().p_W;
  hand_.publish(start);
  while (!hasTilesOf(*leg_) && let_time_pass()) {
  }
  hand_.publish(focus());
}

LegTravel::Totals LegTravel::totals() const noexcept {
  Totals totals = past_totals_;
  add(totals, *leg_);
  return totals;
}

}  // namespace filiform::internal
