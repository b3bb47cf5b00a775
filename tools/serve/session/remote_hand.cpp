#include "tools/serve/session/remote_hand.h"

#include <algorithm>
#include <cmath>

namespace filiform::tools {

RemoteHand::RemoteHand(const RemoteHandOptions& options)
    : hold_ticks_(static_cast<std::uint64_t>(std::max(1.0, options.hold_s / kPeriod_s))) {
  capabilities_.name = "remote hand";
  capabilities_.workspace_lo_D = options.lo_D;
  capabilities_.workspace_hi_D = options.hi_D;
  capabilities_.peak_force_N = options.peak_force_N;
  capabilities_.nominal_rate_Hz = 1 / kPeriod_s;
  capabilities_.senses_rotation = true;
}

bool RemoteHand::isUsable(const v1::Hand& hand) noexcept {
  for (const double value : hand.h_D)
    if (!(std::abs(value) <= kMost_m)) return false;
  constexpr float kMost_rad_s = 100;
  for (const float value : hand.twist_D)
    if (!(std::abs(value) <= kMost_rad_s)) return false;
  return true;
}

bool RemoteHand::receive(const v1::Hand& hand) noexcept {
  if (!isUsable(hand)) {
    refused_.fetch_add(1, std::memory_order_relaxed);
    return false;
  }
  newest_.publish(hand);
  return true;
}

void RemoteHand::open() { state_.status = DeviceStatus::homing; }
void RemoteHand::close() noexcept { state_.status = DeviceStatus::closed; }

DeviceState RemoteHand::exchange(const Wrench&) noexcept {
  state_.time_s = static_cast<double>(period_) * kPeriod_s;
  fresh_ = newest_.take(used_.hand);
  if (fresh_) {
    const v1::Hand& hand = used_.hand;
    path_.take({hand.h_D[0], hand.h_D[1], hand.h_D[2]}, period_, used_.tick == 0 || silent_);
    used_.tick = period_;
  }
  silent_ = used_.tick == 0 || period_ - used_.tick >= hold_ticks_;
  was_blocked_ = blocked_.load(std::memory_order_relaxed);
  if (state_.status == DeviceStatus::closed) return state_;
  const bool ready = !silent_ && !was_blocked_ && (used_.hand.flags & v1::kLetGo) == 0;
  state_.status = ready ? DeviceStatus::ready : DeviceStatus::homing;
  const Eigen::Vector3d before_D = state_.p_D;
  state_.p_D = path_.at(period_);
  state_.v_D = fresh_ || !ready ? Eigen::Vector3d::Zero() : Eigen::Vector3d((state_.p_D - before_D) / kPeriod_s);
  state_.twist_D.setZero();
  if (ready) state_.twist_D = Eigen::Vector3f(used_.hand.twist_D).cast<double>();
  return state_;
}

}  // namespace filiform::tools
