// The mechanics of a hand, as a device: a mass pulled by a spring and a damper towards a moving target, holding the
// handle of a device with some viscous damping of its own. Who decides where the target goes lives elsewhere
// (solver/simulated_person.h).
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

// loose 0.10 kg, 2 N s/m, 30 N/m; medium 0.15, 5, 200; firm 0.30, 12, 600. Throws UnknownDevice naming the choices.
HandParameters handParameters(const std::string& name);

struct SimulatedHandOptions {
  HandParameters hand;
  double period_s = 0.001;  // of exchange(), virtual time
  int delay_samples = 1;    // 0, 1 or 2: a wrench acts that many periods late
  double device_damping_Ns_m = 0.5;
  double peak_force_N = 20;  // a stronger force saturates, keeping its direction
  Eigen::Vector3d start_D = Eigen::Vector3d::Zero();
};

// Force and target are held over a period and the motion in between is the exact solution, so there is no integration
// error at any stiffness, mass or period. Deterministic: every exchange advances virtual time by one period and never
// blocks. The state that exchange returns is that at the end of the period; with delay 0 its wrench has acted over that
// whole period. A wall of stiffness K is stable below b / (T/2 + d T), b the damping of hand and device together.
// Thread rule: as HapticDevice; setTarget, reset and injectFault belong to the thread that calls exchange.
class SimulatedHand : public HapticDevice {
 public:
  // The hand can reach that far from the centre of the workspace on each axis.
  static constexpr double kReach_m = 10;

  // Throws DeviceError on options that describe no hand: mass or period not positive, damping or stiffness negative, a
  // delay other than 0, 1 or 2, anything not finite.
  explicit SimulatedHand(const SimulatedHandOptions& options);
  ~SimulatedHand() override;

  // Where the muscles pull to from the next exchange on (m, frame D). Ignored if not finite or out of reach.
  void setTarget(const Eigen::Vector3d& target_D) noexcept;
  // Puts hand and target there, at rest, and forgets wrenches that have not acted yet (a jump of the workspace). Time
  // goes on. Ignored if not finite or out of reach.
  void reset(const Eigen::Vector3d& p_D) noexcept;
  // From now on the device is lost: status fault, the last state, no more motion, until it is opened again.
  void injectFault() noexcept;

  const DeviceCapabilities& capabilities() const override;
  DeviceStatus status() const noexcept override;
  void open() override;
  void close() noexcept override;
  DeviceState exchange(const Wrench& wrench) noexcept override;
  // Nothing: between exchanges its time stands still, and no force acts.
  void relax() noexcept override {}

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform
