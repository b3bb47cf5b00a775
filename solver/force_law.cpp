#include "solver/force_law.h"

#include "solver/internal/option_check.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

namespace filiform {
namespace {

using Eigen::Vector3d;
using internal::isNotNegative;
using internal::isPositive;
using internal::require;

// Without overflow on the way; infinite or NaN iff the vector's length is no double.
double lengthOf(const Vector3d& v) {
  if (!v.allFinite()) return std::numeric_limits<double>::infinity();
  const double largest = v.cwiseAbs().maxCoeff();
  return largest > 0 ? largest * (v / largest).norm() : 0.0;
}

}  // namespace

ForceLaw::ForceLaw(const ForceLawOptions& options) : options_(options), passivity_(options.passivity) {
  require(isPositive(options.stiffness_N_m), "stiffness (N/m)", options.stiffness_N_m, "> 0");
  require(isNotNegative(options.damping_Ns_m), "damping (N s/m)", options.damping_Ns_m, ">= 0");
  require(isPositive(options.max_force_N), "maximum force (N)", options.max_force_N, "> 0");
  require(isPositive(options.max_slew_N_s), "maximum slew (N/s)", options.max_slew_N_s, "> 0");
  require(isNotNegative(options.free_speed_m_s), "free speed (m/s)", options.free_speed_m_s, ">= 0");
  require(isNotNegative(options.ramp_s), "ramp (s)", options.ramp_s, ">= 0");
}

Vector3d ForceLaw::apply(const Vector3d& p_D, const Vector3d& h_D, const Vector3d& v_D, double dt_s) noexcept {
  const double dt = std::isfinite(dt_s) && dt_s > 0 ? dt_s : 0.0;
  const bool started = started_;
  if (started) since_start_s_ += dt;
  started_ = true;
  const double ramp = options_.ramp_s > 0 ? std::min(1.0, since_start_s_ / options_.ramp_s) : 1.0;

  Vector3d force = options_.stiffness_N_m * (p_D - h_D);
  if (options_.damping_Ns_m > 0) force -= options_.damping_Ns_m * v_D;
  double length = lengthOf(force);
  if (!std::isfinite(length)) {
    ++events_.not_finite;
    return release();
  }
  const double stored_J = storedEnergy(lengthOf(p_D - h_D));
  force = passivity_.apply(force, h_D, stored_J, started ? storedEnergy(lengthOf(last_p_D_ - h_D)) : stored_J, dt);
  const double step_m = started ? std::min(lengthOf(h_D - last_h_D_), options_.free_speed_m_s * dt) : 0.0;
  last_p_D_ = p_D;
  last_h_D_ = h_D;
  length = lengthOf(force);
  if (length > options_.max_force_N) {
    ++events_.clamped;
    force *= options_.max_force_N / length;
    length = options_.max_force_N;
  }
  // What of the last force still points the new way may stay; anything else of it is let go at once; what is added is
  // limited, but for what the hand itself stretches the spring by.
  if (length > 0) {
    const double kept = std::max(0.0, last_force_N_.dot(force) / length);
    const double allowed = kept + options_.max_slew_N_s * dt + options_.stiffness_N_m * step_m;
    if (length > allowed) {
      ++events_.slewed;
      force *= allowed / length;
    }
  }
  last_force_N_ = force;
  force *= ramp;
  passivity_.sent(force);
  return force;
}

Vector3d ForceLaw::release() noexcept {
  last_force_N_.setZero();
  passivity_.sent(Vector3d::Zero());
  return Vector3d::Zero();
}

void ForceLaw::restartRamp() noexcept {
  last_force_N_.setZero();
  since_start_s_ = 0;
  started_ = false;
  passivity_.restart();
}

void ForceLaw::carried(const Vector3d& shift_D) noexcept {
  last_p_D_ -= shift_D;
  last_h_D_ -= shift_D;
  passivity_.carried(shift_D);
}

double ForceLaw::storedEnergy(double extension_m) const noexcept {
  const double linear_m = options_.max_force_N / options_.stiffness_N_m;
  const double within_m = std::min(extension_m, linear_m);
  const double energy_J =
      0.5 * options_.stiffness_N_m * within_m * within_m + options_.max_force_N * (extension_m - within_m);
  return energy_J < 1e12 ? energy_J : 1e12;
}

double stiffnessBound(double damping_Ns_m, double period_s, double delay_samples) noexcept {
  return damping_Ns_m / (period_s * (0.5 + delay_samples));
}

double defaultStiffness(const DeviceCapabilities& device, double period_s) noexcept {
  double stiffness = 200;
  if (device.damping_Ns_m > 0)
    stiffness = std::min(stiffness, 0.8 * stiffnessBound(device.damping_Ns_m, period_s, device.delay_samples));
  if (device.max_stiffness_N_m > 0) stiffness = std::min(stiffness, device.max_stiffness_N_m);
  return stiffness;
}

}  // namespace filiform
