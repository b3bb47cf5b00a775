// NullDevice: reports one settable position and renders nothing. For runs without a device, and for tests of every
// status. Thread rule: thread-compatible.
#pragma once

#include "device/haptic_device.h"

namespace filiform {

class NullDevice : public HapticDevice {
 public:
  explicit NullDevice(double period_s = 0.001);

  // Sets the reported position (m, frame D), initially the centre. Ignored if not finite.
  void setPosition(const Eigen::Vector3d& p_D) noexcept;
  void setButtons(std::uint32_t buttons) noexcept { state_.buttons = buttons; }
  // Sets the status, as a change in the hardware would.
  void setStatus(DeviceStatus status) noexcept { state_.status = status; }

  // The last wrench as a device would render it: zero if it was not finite or the status was not ready.
  const Wrench& lastWrench() const noexcept { return last_wrench_; }

  const DeviceCapabilities& capabilities() const override { return capabilities_; }
  DeviceStatus status() const noexcept override { return state_.status; }
  void open() override;
  void close() noexcept override;
  // Advances virtual time by one period while ready. The velocity is always zero.
  DeviceState exchange(const Wrench& wrench) noexcept override;

 private:
  DeviceCapabilities capabilities_;
  double period_s_;
  std::uint64_t periods_ = 0;
  DeviceState state_;
  Wrench last_wrench_;
};

}  // namespace filiform
