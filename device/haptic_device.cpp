#include "device/haptic_device.h"

namespace filiform {

const char* toString(DeviceStatus status) {
  switch (status) {
    case DeviceStatus::closed:
      return "closed";
    case DeviceStatus::booting:
      return "booting";
    case DeviceStatus::homing:
      return "homing";
    case DeviceStatus::ready:
      return "ready";
    case DeviceStatus::fault:
      return "fault";
  }
  return "unknown";
}

Wrench finiteOrZero(const Wrench& wrench) noexcept {
  return wrench.force_N.allFinite() && wrench.torque_Nm.allFinite() ? wrench : Wrench();
}

}  // namespace filiform
