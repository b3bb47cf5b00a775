// A device that moves through given points at given times, whatever force it is sent: for tests and for measuring
// without a hand. Thread rule: as HapticDevice.
#pragma once

#include "device/haptic_device.h"

#include <cstddef>
#include <vector>

namespace filiform {

struct ScriptedPoint {
  double time_s = 0;
  Eigen::Vector3d p_D = Eigen::Vector3d::Zero();  // m
  std::uint32_t buttons = 0;                      // held from this point until the next
};

// Straight between points at constant speed, exactly on a point at its time, at rest before the first and after the
// last.
class ScriptedPath : public HapticDevice {
 public:
  // Throws DeviceError unless there is a point, times rise strictly from >= 0, and all is finite.
  explicit ScriptedPath(std::vector<ScriptedPoint> points, double period_s = 0.001);

  // True once an exchange has reported the last point.
  bool finished() const noexcept { return state_.time_s >= points_.back().time_s; }
  // As a device would have rendered it: zero unless it was finite and the status was ready.
  const Wrench& lastWrench() const noexcept { return last_wrench_; }

  const DeviceCapabilities& capabilities() const override { return capabilities_; }
  DeviceStatus status() const noexcept override { return state_.status; }
  // Starts again at time 0.
  void open() override;
  void close() noexcept override;
  // Advances virtual time by one period. O(points passed).
  DeviceState exchange(const Wrench& wrench) noexcept override;

 private:
  void place() noexcept;

  std::vector<ScriptedPoint> points_;
  DeviceCapabilities capabilities_;
  double period_s_;
  std::uint64_t periods_ = 0;
  std::size_t next_ = 0;  // the first point whose time is still to come
  DeviceState state_;
  Wrench last_wrench_;
};

}  // namespace filiform
