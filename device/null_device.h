// A device that is nobody's hand: it reads one settable position and renders nothing. It stands in where no device is
// wanted, and leads tests through every status. Thread rule: thread-compatible.
#pragma once

#include "device/haptic_device.h"

namespace filiform {

class NullDevice : public HapticDevice {
 public:
  explicit NullDevice(double period_s = 0.001);

  // What exchange reports from now on (m, frame D); the centre at first. Ignored if not finite.
  void setPosition(const Eigen::Vector3d& p_D) noexcept;
  void setButtons(std::uint32_t buttons) noexcept { state_.buttons = buttons; }
  // Puts the device in that state, as if its hardware had got there.
  void setStatus(DeviceStatus status) noexcept { state_.status = status; }

  // As a device would have rendered it: zero unless it was finite and the status was ready.
  const Wrench& lastWrench() const noexcept { return last_wrench_; }

  const DeviceCapabilities& capabilities() const override { return capabilities_; }
  DeviceStatus status() const noexcept override { return state_.status; }
  void open() override;
  void close() noexcept override;
  // Every exchange while ready advances virtual time by one period; the velocity is always zero.
  DeviceState exchange(const Wrench& wrench) noexcept override;

 private:
  DeviceCapabilities capabilities_;
  double period_s_;
  std::uint64_t periods_ = 0;
  DeviceState state_;
  Wrench last_wrench_;
};

}  // namespace filiform
