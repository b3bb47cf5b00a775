// SimulatedHand: the mechanics of a hand that holds a device. A spring and a damper pull a mass towards a moving
// target; the handle adds its own viscous damping. solver/travel/routes/simulated_person.h decides the target.
#pragma once

#include "device/haptic_device.h"

#include <memory>
#include <string>

namespace filiform {

struct HandParameters {  // m x'' = k (target - x) - (b + device damping) x' + force
  double mass_kg = 0.15;
  double damping_Ns_m = 5;
  double stiffness_N_m = 200;
};

// The parameters by name: loose 0.10 kg, 2 N s/m, 30 N/m; medium 0.15, 5, 200; firm 0.30, 12, 600. Throws
// UnknownDevice, which lists the names.
HandParameters handParameters(const std::string& name);

struct SimulatedHandOptions {
  HandParameters hand;
  double period_s = 0.001;  // virtual time of one exchange()
  int delay_samples = 1;    // 0, 1 or 2: periods after which a wrench acts
  double device_damping_Ns_m = 0.5;
  double peak_force_N = 20;  // a stronger force is limited and keeps its direction
  Eigen::Vector3d start_D = Eigen::Vector3d::Zero();
};

// Force and target are constant over a period; the motion in between is the exact solution. So there is no integration
// error at any stiffness, mass or period. Deterministic: each exchange advances virtual time by one period and never
// blocks. It returns the state at the end of the period; with delay 0, its wrench has acted over the whole period.
//
// A wall of stiffness K is stable below b / (T/2 + d T). b is the damping of hand and device, T the period and d the
// delay. Thread rule: as HapticDevice; the thread that calls exchange() also calls setTarget(), reset() and
// injectFault().
class SimulatedHand : public HapticDevice {
 public:
  // Positions and targets may lie within this distance of the workspace's centre on each axis.
  static constexpr double kReach_m = 10;

  // Throws DeviceError if mass or period is not positive, damping or stiffness is negative, the delay is not 0, 1 or 2,
  // or a value is not finite.
  explicit SimulatedHand(const SimulatedHandOptions& options);
  ~SimulatedHand() override;

  // Sets the target of the spring (m, frame D) from the next exchange on. Ignored if not finite or out of reach.
  void setTarget(const Eigen::Vector3d& target_D) noexcept;
  // Places hand and target at p_D, at rest, and drops wrenches that have not acted yet: used when the workspace jumps.
  // Time continues. Ignored if not finite or out of reach.
  void reset(const Eigen::Vector3d& p_D) noexcept;
  // Simulates a lost device until open(): status fault, the last state, no motion.
  void injectFault() noexcept;

  const DeviceCapabilities& capabilities() const override;
  DeviceStatus status() const noexcept override;
  void open() override;
  void close() noexcept override;
  DeviceState exchange(const Wrench& wrench) noexcept override;
  // No effect: between exchanges virtual time stands still and no force acts.
  void relax() noexcept override {}

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform
