// NullDevice: reports one settable position and renders nothing. For runs without a device, and for tests of every
// status. Thread rule: one thread at a time.
#pragma once

#include "device/haptic_device.h"

namespace filiform {

class NullDevice : public HapticDevice {
 public:
  // `period_s`: virtual time (s) between two samples. Throws DeviceError unless it is > 0 and finite.
  explicit NullDevice(double period_s = 0.001);

  // Sets the reported position (m, frame D). It is zero at first. Ignored if not finite.
  void setPosition(const Eigen::Vector3d& p_D) noexcept;
  void setButtons(std::uint32_t buttons) noexcept { state_.buttons = buttons; }
  // Imitates a change in the hardware, for example DeviceStatus::fault when it is unplugged.
  void setStatus(DeviceStatus status) noexcept { state_.status = status; }

  // The wrench of the last exchange(). Zero if that wrench was not finite, if the status was not ready, before the
  // first exchange() and after close().
  const Wrench& lastWrench() const noexcept { return last_wrench_; }

  const DeviceCapabilities& capabilities() const override { return capabilities_; }
  DeviceStatus status() const noexcept override { return state_.status; }
  void open() override;            // sets the virtual time to zero and the status to ready
  void close() noexcept override;  // sets the status to closed
  // Returns at once. While ready, advances the virtual time by one period; otherwise the time stands still. The
  // velocity is always zero.
  DeviceState exchange(const Wrench& wrench) noexcept override;

 private:
  DeviceCapabilities capabilities_;
  double period_s_;
  std::uint64_t periods_ = 0;
  DeviceState state_;
  Wrench last_wrench_;
};

}  // namespace filiform
