// A device that paces the loop by its own clock, which is faster than real time so that tests are short.
#pragma once

#include "device/haptic_device.h"

#include <chrono>
#include <thread>

namespace filiform::test {

class PacedDevice : public HapticDevice {
 public:
  // Rests at p_D (m) from the second sample on; before, at the centre.
  PacedDevice(double period_s, const Eigen::Vector3d& p_D) : period_s_(period_s), p_D_(p_D) {
    capabilities_.name = "paced";
    capabilities_.paces_loop = true;
    capabilities_.delay_samples = 1;
    capabilities_.max_stiffness_N_m = 200;
  }
  DeviceCapabilities& changeCapabilities() { return capabilities_; }
  const DeviceCapabilities& capabilities() const override { return capabilities_; }
  DeviceStatus status() const noexcept override { return state_.status; }
  void open() override { state_.status = DeviceStatus::ready; }
  void close() noexcept override { state_.status = DeviceStatus::closed; }
  DeviceState exchange(const Wrench& wrench) noexcept override {
    std::this_thread::sleep_for(std::chrono::microseconds(100));
    state_.time_s = period_s_ * ++samples_;
    if (samples_ > 1) state_.p_D = p_D_;
    state_.sent_N = wrench.force_N;
    return state_;
  }
  void relax() noexcept override {}

 private:
  double period_s_;
  Eigen::Vector3d p_D_;
  DeviceCapabilities capabilities_;
  DeviceState state_;
  int samples_ = 0;
};

}  // namespace filiform::test
