#include "solver/force/force_law.h"

#include "device/vector_length.h"
#include "solver/force/internal/option_check.h"

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

}  // namespace

ForceLaw::ForceLaw(const ForceLawOptions& options)
    : options_(options),
      passivity_(options.passivity),
      gate_({options.max_force_N, options.max_slew_N_s, options.ramp_s, options.fade_s, options.max_slew_N_s}) {
  require(isPositive(options.stiffness_N_m), "stiffness (N/m)", options.stiffness_N_m, "> 0");
  require(isNotNegative(options.damping_Ns_m), "damping (N s/m)", options.damping_Ns_m, ">= 0");
  require(isPositive(options.max_force_N), "maximum force (N)", options.max_force_N, "> 0");
  require(isPositive(options.max_slew_N_s), "maximum slew (N/s)", options.max_slew_N_s, "> 0");
  require(isNotNegative(options.free_speed_m_s), "free speed (m/s)", options.free_speed_m_s, ">= 0");
}

Vector3d ForceLaw::apply(const Vector3d& p_D, const Vector3d& h_D, const Vector3d& v_D, double dt_s) noexcept {
  const double dt = std::isfinite(dt_s) && dt_s > 0 ? dt_s : 0.0;
  const bool started = started_;
  started_ = true;
  Vector3d force = options_.stiffness_N_m * (p_D - h_D);
  if (options_.damping_Ns_m > 0) force -= options_.damping_Ns_m * v_D;
  if (!std::isfinite(lengthOf(force))) {
    ++not_finite_;
    return release();
  }
  // During a fade the old force acts. The spring of the new place already stores energy, but pulls only after the fade.
  const double faded_J = storedInFade(dt);
  if (gate_.fading()) force = gate_.faded_N(dt);
  const double stored_J = storedEnergy(lengthOf(p_D - h_D)) + faded_J;
  const double by_last_J = started && last_p_D_ != p_D ? storedEnergy(lengthOf(last_p_D_ - h_D)) + faded_J : stored_J;
  force = passivity_.apply(force, h_D, stored_J, by_last_J, dt);
  const double step_m = started ? std::min(lengthOf(h_D - last_h_D_), options_.free_speed_m_s * dt) : 0.0;
  last_p_D_ = p_D;
  last_h_D_ = h_D;
  return send(force, dt, options_.stiffness_N_m * step_m);
}

Vector3d ForceLaw::applyNothing(const Vector3d& h_D, double dt_s) noexcept {
  if (!h_D.allFinite()) return release();
  const double dt = std::isfinite(dt_s) && dt_s > 0 ? dt_s : 0.0;
  if (!gate_.fading()) {  // the controller must know that the hand moves without force
    static_cast<void>(passivity_.apply(Vector3d::Zero(), h_D, 0, 0, dt));
    return release();
  }
  const double faded_J = storedInFade(dt);
  return send(passivity_.apply(gate_.faded_N(dt), h_D, faded_J, faded_J, dt), dt, 0);
}

Vector3d ForceLaw::send(const Vector3d& allowed_N, double dt_s, double free_N) noexcept {
  ForceGate::Input input;
  input.wanted.force_N = allowed_N;
  input.dt_s = dt_s;
  input.free_N = free_N;
  const Vector3d sent_N = gate_.pass(input).force_N;
  passivity_.sent(sent_N);
  return sent_N;
}

// The energy of a spring that pulls with the fading force. It accounts for the energy that the fade gives to the hand.
double ForceLaw::storedInFade(double dt_s) const noexcept {
  return gate_.fading() ? storedEnergy(gate_.faded_N(dt_s).norm() / options_.stiffness_N_m) : 0.0;
}

Vector3d ForceLaw::release() noexcept {
  gate_.cut();
  passivity_.sent(Vector3d::Zero());
  return Vector3d::Zero();
}

void ForceLaw::restart() noexcept {
  gate_.restart();
  started_ = false;
  passivity_.restart();
}

void ForceLaw::restartFromZero() noexcept {
  gate_.close();
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

double stiffnessBound(double damping_Ns_m, double period_s, double delay_samples,
                      double virtual_damping_Ns_m) noexcept {
  return std::max(0.0, damping_Ns_m - std::abs(virtual_damping_Ns_m)) / (period_s * (0.5 + delay_samples));
}

double mostStiffness(const DeviceCapabilities& device, double period_s) noexcept {
  double stiffness = std::numeric_limits<double>::infinity();
  if (device.damping_Ns_m > 0) stiffness = 0.8 * stiffnessBound(device.damping_Ns_m, period_s, device.delay_samples);
  if (device.max_stiffness_N_m > 0) stiffness = std::min(stiffness, device.max_stiffness_N_m);
  return stiffness;
}

double defaultStiffness(const DeviceCapabilities& device, double period_s) noexcept {
  return std::min(200.0, mostStiffness(device, period_s));
}

}  // namespace filiform
