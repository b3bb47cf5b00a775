// What a recording has of each exchange besides the state: the forces that were sent, and marks of the run. Thread
// rule: values.
#pragma once

#include "device/haptic_device.h"

#include <array>
#include <cstdint>

namespace filiform {

// The part of a wrench that is recorded.
struct RecordedForces {
  Eigen::Vector3d force_N = Eigen::Vector3d::Zero(), torque_Nm = Eigen::Vector3d::Zero();
};

// Data of the run for one exchange, needed to repeat the run exactly. Stored verbatim; not interpreted here.
struct RunMarks {
  std::uint32_t bits = 0;
  std::uint32_t count = 0;  // number of values used
  std::array<std::uint32_t, 6> values{};
};

namespace internal {

struct RecordedExchange {
  RecordedForces wrench;
  DeviceState state;
  RunMarks marks;
};

}  // namespace internal

}  // namespace filiform
