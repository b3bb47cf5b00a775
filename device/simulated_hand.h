// The mechanics of a hand, as a device: a mass pulled by a spring and a damper towards a moving target, holding the handle of a
// device with some viscous damping of its own. Who decides where the target goes lives elsewhere (solver/simulated_person.h).
#pragma once

#include <memory>
#include <string>

#include "device/haptic_device.h"

namespace filiform {

struct HandParameters {  // m x'' = k (target - x) - (b + device damping) x' + force
  double mass_kg = 0.15;
  double damping_Ns_m = 5;
  double stiffness_N_m = 200;
};

// loose 0.10 kg, 2 N s/m, 30 N/m; medium 0.15, 5, 200; firm 0.30, 12, 600. Throws DeviceError naming the choices.
HandParameters handParameters(const std::string& name);

struct SimulatedHandOptions {
  HandParameters hand;
  double period_s = 0.001;              // of exchange(), virtual time
  int substeps = 4;                     // integration steps a period, the force held over all of them
  int delay_samples = 1;                // 0, 1 or 2: a wrench acts that many periods late
  double device_damping_Ns_m = 0.5;
  Eigen::Vector3d start_D = Eigen::Vector3d::Zero();
};

// Deterministic; every exchange advances virtual time by one period and never blocks. Thread rule: as HapticDevice, and setTarget
// belongs to the thread that calls exchange.
class SimulatedHand : public HapticDevice {
 public:
  explicit SimulatedHand(const SimulatedHandOptions& options);
  ~SimulatedHand() override;

  // Where the muscles pull to from the next exchange on (m, frame D). Ignored if not finite.
  void setTarget(const Eigen::Vector3d& target_D) noexcept;
  // Puts the hand there at rest (a jump of the workspace).
  void reset(const Eigen::Vector3d& p_D) noexcept;

  const DeviceCapabilities& capabilities() const override;
  DeviceStatus status() const noexcept override;
  void open() override;
  void close() noexcept override;
  DeviceState exchange(const Wrench& wrench) noexcept override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform
