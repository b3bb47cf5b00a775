#include "device/check/device_walk.h"

#include <algorithm>
#include <cmath>

namespace filiform::tools {
namespace {

constexpr double kSoftest_N_m = 25;
constexpr double kKick_N = 0.3, kKick_s = 0.02;  // starts a vibration where there can be one
constexpr double kMoves_m_s = 0.005;             // a slower motion has no direction
// In the second half, 0.3 s: a vibration has 8 Hz or more.
constexpr int kVibrationReversals = 5;
constexpr double kVibration_m_s = 0.01;

}  // namespace

DeviceWalk::DeviceWalk(const DeviceWalkOptions& options, bool renders_force, double most_N_m)
    : options_(options), renders_force_(renders_force) {
  for (double stiffness_N_m = kSoftest_N_m; stiffness_N_m < most_N_m; stiffness_N_m *= 2)
    found_.sweep.push_back({.stiffness_N_m = stiffness_N_m});
  found_.sweep.push_back({.stiffness_N_m = most_N_m});
}

void DeviceWalk::begin(Phase phase) noexcept {
  pause_left_s_ = phase == this->phase() ? 0 : options_.pause_s;
  elapsed_s_ = 0;
  first_ = true;
  if (phase == Phase::over) found_.sweep.resize(std::min(step_, found_.sweep.size()));
  phase_.store(phase, std::memory_order_release);
}

bool DeviceWalk::movedTooFar(const DeviceState& state) const noexcept {
  return !((state.p_D - start_D_).norm() <= options_.most_moved_m);
}

Wrench DeviceWalk::tick(const DeviceState& state, double dt_s) noexcept {
  Wrench wrench;
  const Phase phase = this->phase();
  if (phase == Phase::over) return wrench;
  if (state.status == DeviceStatus::closed) begin(Phase::over);  // end of a recording
  if (state.status != DeviceStatus::ready) return wrench;
  if (pause_left_s_ > 0) {
    pause_left_s_ -= dt_s;
    return wrench;
  }
  if (first_) {
    start_D_ = last_D_ = state.p_D;
    if (phase == Phase::workspace) found_.lo_D = found_.hi_D = state.p_D;
    squares_ = seconds_ = 0;
    sign_.setZero();
    first_ = false;
  }
  elapsed_s_ += dt_s;
  switch (phase) {
    case Phase::workspace:
      found_.lo_D = found_.lo_D.cwiseMin(state.p_D);
      found_.hi_D = found_.hi_D.cwiseMax(state.p_D);
      if (elapsed_s_ >= options_.workspace_s) begin(renders_force_ ? Phase::gravity : Phase::over);
      break;
    case Phase::gravity:
      found_.drift_m = state.p_D - start_D_;
      found_.fastest_drift_m_s = std::max(found_.fastest_drift_m_s, state.v_D.norm());
      if (elapsed_s_ >= options_.gravity_s) begin(Phase::springs);
      break;
    case Phase::springs:
      wrench.force_N = stretch(state);
      break;
    case Phase::damping:
      wrench.force_N = damp(state);
      break;
    case Phase::sweep:
      wrench.force_N = hold(state, dt_s);
      break;
    case Phase::over:
      break;
  }
  last_D_ = state.p_D;
  if (const double length_N = wrench.force_N.norm(); length_N > options_.force_N)
    wrench.force_N *= options_.force_N / length_N;
  return wrench;
}

// The end of the spring moves away during the first half of the time, and comes back in the last fifth.
Eigen::Vector3d DeviceWalk::stretch(const DeviceState& state) noexcept {
  DeviceWalkFound::Spring& spring = found_.springs[axis_];
  const auto axis = static_cast<Eigen::Index>(axis_);
  const double share = elapsed_s_ / options_.spring_s;
  spring.stopped = spring.stopped || movedTooFar(state);
  if (share >= 1 || spring.stopped) {
    ++axis_;
    begin(axis_ == found_.springs.size() ? Phase::damping : Phase::springs);
    return Eigen::Vector3d::Zero();
  }
  Eigen::Vector3d end_D = start_D_;
  end_D[axis] += options_.offset_m * std::min({1.0, 2 * share, 5 * (1 - share)});
  const Eigen::Vector3d force_N = options_.spring_N_m * (end_D - state.p_D);
  if (share < 0.8) {
    spring.moved_m = state.p_D[axis] - start_D_[axis];
    spring.force_N = force_N[axis];
  }
  return force_N;
}

Eigen::Vector3d DeviceWalk::damp(const DeviceState& state) noexcept {
  if (elapsed_s_ >= options_.damping_s) {
    begin(Phase::sweep);
    return Eigen::Vector3d::Zero();
  }
  if (state.sent_N) found_.damped_J -= state.sent_N->dot(state.p_D - last_D_);
  found_.fastest_damped_m_s = std::max(found_.fastest_damped_m_s, state.v_D.norm());
  return -options_.damping_Ns_m * std::min(1.0, 4 * elapsed_s_ / options_.damping_s) * state.v_D;
}

Eigen::Vector3d DeviceWalk::hold(const DeviceState& state, double dt_s) noexcept {
  DeviceWalkFound::Step& step = found_.sweep[step_];
  if (movedTooFar(state)) {
    found_.sweep_stopped = true;
    begin(Phase::over);
    return Eigen::Vector3d::Zero();
  }
  if (elapsed_s_ > 0.5 * options_.sweep_s) {
    squares_ += state.v_D.squaredNorm() * dt_s;
    seconds_ += dt_s;
    for (int axis = 0; axis < 3; ++axis) {
      if (std::abs(state.v_D[axis]) < kMoves_m_s) continue;
      const double sign = state.v_D[axis] > 0 ? 1 : -1;
      if (sign_[axis] == -sign) ++step.reversals;
      sign_[axis] = sign;
    }
  }
  if (elapsed_s_ >= options_.sweep_s) {
    step.speed_m_s = seconds_ > 0 ? std::sqrt(squares_ / seconds_) : 0;
    step.vibrates = step.reversals >= kVibrationReversals && step.speed_m_s > kVibration_m_s;
    ++step_;
    begin(step.vibrates || step_ == found_.sweep.size() ? Phase::over : Phase::sweep);
    return Eigen::Vector3d::Zero();
  }
  Eigen::Vector3d force_N = step.stiffness_N_m * (start_D_ - state.p_D);
  if (elapsed_s_ < kKick_s) force_N.x() += kKick_N;
  return force_N;
}

}  // namespace filiform::tools
