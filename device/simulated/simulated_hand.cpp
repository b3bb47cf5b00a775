#include "device/simulated/simulated_hand.h"

#include "device/device_gate.h"

#include <array>
#include <cmath>

#include <Eigen/Core>

namespace filiform {

namespace {

// exp([0 1 0; -k/m -c/m 1/m; 0 0 0] T): the change of position and velocity (m, m/s) over T under a constant force.
// Scaling and squaring of the Taylor series works for every damping, also critical damping and a free mass.
Eigen::Matrix3d heldForceResponse(double mass_kg, double damping_Ns_m, double stiffness_N_m, double period_s) {
  Eigen::Matrix3d a;
  a << 0, 1, 0, -stiffness_N_m / mass_kg, -damping_Ns_m / mass_kg, 1 / mass_kg, 0, 0, 0;
  a *= period_s;
  int squarings = 0;
  for (double norm = a.cwiseAbs().rowwise().sum().maxCoeff(); norm > 0.25; norm /= 2) ++squarings;
  a *= std::ldexp(1.0, -squarings);
  Eigen::Matrix3d result = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d term = Eigen::Matrix3d::Identity();
  for (int i = 1; i <= 12; ++i) {
    term = (term * a / i).eval();
    result += term;
  }
  for (int i = 0; i < squarings; ++i) result = (result * result).eval();
  return result;
}

bool within(const Eigen::Vector3d& p_D) {
  return p_D.allFinite() && p_D.cwiseAbs().maxCoeff() <= SimulatedHand::kReach_m;
}

void requireParameter(bool condition, const char* what) {
  if (!condition) throw DeviceError(std::string("simulated hand: ") + what);
}

}  // namespace

HandParameters handParameters(const std::string& name) {
  if (name == "loose") return {0.10, 2, 30};
  if (name == "medium") return {0.15, 5, 200};
  if (name == "firm") return {0.30, 12, 600};
  throw UnknownDevice("no such hand '" + name + "'; choose loose, medium or firm", name, {"loose", "medium", "firm"});
}

struct SimulatedHand::Impl {
  SimulatedHandOptions options;
  DeviceCapabilities capabilities;
  Eigen::Matrix3d response;
  DeviceStatus status = DeviceStatus::closed;
  Eigen::Vector3d p_D, v_D, target_D;
  std::array<Eigen::Vector3d, 2> pending_N;  // forces that have not acted yet, oldest first
  std::uint64_t periods = 0;

  void rest(const Eigen::Vector3d& at_D) {
    p_D = target_D = at_D;
    v_D.setZero();
    pending_N.fill(Eigen::Vector3d::Zero());
  }

  DeviceState state(const Eigen::Vector3d& sent_N) const {
    DeviceState s;
    s.sent_N = sent_N;
    s.time_s = static_cast<double>(periods) * options.period_s;
    s.p_D = p_D;
    s.v_D = v_D;
    s.status = status;
    return s;
  }

  Eigen::Vector3d delayed(const Eigen::Vector3d& force_N) {
    if (options.delay_samples == 0) return force_N;
    Eigen::Vector3d due_N = pending_N[0];
    pending_N[0] = options.delay_samples == 1 ? force_N : pending_N[1];
    pending_N[1] = force_N;
    return due_N;
  }
};

SimulatedHand::SimulatedHand(const SimulatedHandOptions& options) : impl_(std::make_unique<Impl>()) {
  const HandParameters& hand = options.hand;
  requireParameter(std::isfinite(hand.mass_kg) && hand.mass_kg > 0, "the mass must be positive");
  requireParameter(std::isfinite(hand.damping_Ns_m) && hand.damping_Ns_m >= 0, "the damping must not be negative");
  requireParameter(std::isfinite(hand.stiffness_N_m) && hand.stiffness_N_m >= 0, "the stiffness must not be negative");
  requireParameter(std::isfinite(options.period_s) && options.period_s > 0, "the period must be positive");
  requireParameter(options.delay_samples >= 0 && options.delay_samples <= 2, "the delay must be 0, 1 or 2 samples");
  requireParameter(std::isfinite(options.device_damping_Ns_m) && options.device_damping_Ns_m >= 0,
                   "the device's damping must not be negative");
  requireParameter(std::isfinite(options.peak_force_N) && options.peak_force_N >= 0,
                   "the peak force must not be negative");
  requireParameter(within(options.start_D), "the start must be within 10 m");
  Impl& d = *impl_;
  d.options = options;
  const double damping_Ns_m = hand.damping_Ns_m + options.device_damping_Ns_m;
  d.response = heldForceResponse(hand.mass_kg, damping_Ns_m, hand.stiffness_N_m, options.period_s);
  requireParameter(d.response.allFinite(), "the ratios of mass, damping, stiffness and period are too extreme");
  d.capabilities.name = "simulated hand";
  d.capabilities.peak_force_N = options.peak_force_N;
  d.capabilities.continuous_force_N = options.peak_force_N;
  d.capabilities.damping_Ns_m = options.device_damping_Ns_m;
  d.capabilities.nominal_rate_Hz = 1 / options.period_s;
  d.capabilities.delay_samples = options.delay_samples;
  d.rest(options.start_D);
}

SimulatedHand::~SimulatedHand() = default;

void SimulatedHand::setTarget(const Eigen::Vector3d& target_D) noexcept {
  if (within(target_D)) impl_->target_D = target_D;
}

void SimulatedHand::reset(const Eigen::Vector3d& p_D) noexcept {
  if (within(p_D)) impl_->rest(p_D);
}

void SimulatedHand::injectFault() noexcept {
  if (impl_->status != DeviceStatus::closed) impl_->status = DeviceStatus::fault;
}

const DeviceCapabilities& SimulatedHand::capabilities() const { return impl_->capabilities; }

DeviceStatus SimulatedHand::status() const noexcept { return impl_->status; }

void SimulatedHand::open() {
  impl_->rest(impl_->options.start_D);
  impl_->periods = 0;
  impl_->status = DeviceStatus::ready;
}

void SimulatedHand::close() noexcept { impl_->status = DeviceStatus::closed; }

DeviceState SimulatedHand::exchange(const Wrench& wrench) noexcept {
  Impl& d = *impl_;
  if (d.status != DeviceStatus::ready) return d.state(Eigen::Vector3d::Zero());
  Wrench sent = finiteOrZero(wrench);
  DeviceGate::shorten(sent, d.options.peak_force_N);
  const Eigen::Vector3d& force_N = sent.force_N;
  const Eigen::Vector3d drive_N = d.options.hand.stiffness_N_m * d.target_D + d.delayed(force_N);
  const Eigen::Vector3d p_D = d.p_D;
  d.p_D = d.response(0, 0) * p_D + d.response(0, 1) * d.v_D + d.response(0, 2) * drive_N;
  d.v_D = d.response(1, 0) * p_D + d.response(1, 1) * d.v_D + d.response(1, 2) * drive_N;
  ++d.periods;
  return d.state(force_N);
}

}  // namespace filiform
