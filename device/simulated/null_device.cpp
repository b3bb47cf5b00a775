#include "device/simulated/null_device.h"

#include <cmath>

namespace filiform {

NullDevice::NullDevice(double period_s) : period_s_(period_s) {
  if (!std::isfinite(period_s) || period_s <= 0) throw DeviceError("null device: the period must be positive");
  capabilities_.name = "null device";
  capabilities_.nominal_rate_Hz = 1 / period_s;
  capabilities_.buttons = 32;
}

void NullDevice::setPosition(const Eigen::Vector3d& p_D) noexcept {
  if (p_D.allFinite()) state_.p_D = p_D;
}

void NullDevice::open() {
  periods_ = 0;
  state_.time_s = 0;
  state_.status = DeviceStatus::ready;
}

void NullDevice::close() noexcept {
  last_wrench_ = Wrench();
  state_.status = DeviceStatus::closed;
}

DeviceState NullDevice::exchange(const Wrench& wrench) noexcept {
  const bool ready = state_.status == DeviceStatus::ready;
  last_wrench_ = ready ? finiteOrZero(wrench) : Wrench();
  state_.sent_N = last_wrench_.force_N;
  if (ready) state_.time_s = static_cast<double>(++periods_) * period_s_;
  return state_;
}

}  // namespace filiform
