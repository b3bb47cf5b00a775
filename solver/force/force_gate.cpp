#include "solver/force/force_gate.h"

#include "device/device_gate.h"
#include "solver/force/internal/option_check.h"

#include <algorithm>
#include <cmath>

namespace filiform {
namespace {

using Eigen::Vector3d;
using internal::isNotNegative;
using internal::isPositive;
using internal::require;

}  // namespace

ForceGate::ForceGate(const ForceGateOptions& options, bool open)
    : options_(options), ramped_s_(open ? options.ramp_s : 0), ramp_begun_(open) {
  require(options.max_force_N > 0, "maximum force (N)", options.max_force_N, "> 0");
  require(options.max_slew_N_s > 0, "maximum slew (N/s)", options.max_slew_N_s, "> 0");
  require(isNotNegative(options.ramp_s), "ramp (s)", options.ramp_s, ">= 0");
  require(isNotNegative(options.fade_s), "fade (s)", options.fade_s, ">= 0");
  require(isPositive(options.max_fade_N_s), "fastest fade (N/s)", options.max_fade_N_s, "> 0");
}

Wrench ForceGate::pass(const Input& input) noexcept {
  if (input.stale || input.withheld) return close();
  if (!input.ready || !input.wanted.force_N.allFinite() || !input.wanted.torque_Nm.allFinite()) return cut();
  const double dt_s = input.dt_s > 0 && std::isfinite(input.dt_s) ? input.dt_s : 0.0;
  Wrench out = finiteOrZero(input.wanted);
  Vector3d& force_N = out.force_N;
  if (!std::isfinite(lengthOf(force_N))) return cut();
  if (DeviceGate::shorten(out, options_.max_force_N) < 1) ++events_.clamped;
  const double length_N = std::min(lengthOf(force_N), options_.max_force_N);

  if (fading()) {
    const double part = partOf(dt_s);
    const double left_N = std::min(part * lengthOf(fading_N_), lengthOf(sent_.force_N));
    faded_s_ += dt_s;
    if (part > 0) {
      if (length_N > left_N) force_N *= left_N / length_N;
      out.torque_Nm *= part;
      out.model = {};
      out.resistance = 0;
      sent_ = out;
      return out;
    }
    fade_s_ = 0;
  }

  // The component of the last force along the new one is kept; everything else falls at once. Only the increase is
  // limited.
  if (length_N > 0 && std::isfinite(options_.max_slew_N_s)) {
    const double kept_N = std::max(0.0, slewed_N_.dot(force_N) / length_N);
    const double allowed_N = kept_N + options_.max_slew_N_s * dt_s + input.free_N;
    if (length_N > allowed_N) {
      ++events_.slewed;
      DeviceGate::scale(out, allowed_N / length_N);
    }
  }
  slewed_N_ = force_N;
  if (ramp_begun_) ramped_s_ += dt_s;
  ramp_begun_ = true;
  const fb_ramp ramp{0, 1, options_.ramp_s};
  if (const double part = fb_ramp_part(&ramp, ramped_s_); part < 1) {
    DeviceGate::scale(out, part);
    out.torque_Nm *= part;
  }
  sent_ = out;
  return out;
}

Wrench ForceGate::cut() noexcept {
  slewed_N_.setZero();
  fade_s_ = 0;
  sent_ = Wrench{};
  return sent_;
}

Wrench ForceGate::close() noexcept {
  ramped_s_ = 0;
  ramp_begun_ = false;
  return cut();
}

void ForceGate::restart() noexcept {
  const Wrench last = sent_;
  const double length_N = lengthOf(last.force_N);
  close();
  sent_ = last;
  if (!(length_N > 0) || !(options_.fade_s > 0)) return;
  fading_N_ = last.force_N;
  fade_s_ = std::max(options_.fade_s, length_N / options_.max_fade_N_s);
  faded_s_ = 0;
}

double ForceGate::partOf(double dt_s) const noexcept {
  const double dt = dt_s > 0 && std::isfinite(dt_s) ? dt_s : 0.0;
  const fb_ramp fade{1, 0, fade_s_};
  return fb_ramp_part(&fade, faded_s_ + dt);
}

Vector3d ForceGate::faded_N(double dt_s) const noexcept { return partOf(dt_s) * fading_N_; }

}  // namespace filiform
