// ScriptedPath: a device that moves through given points at given times, whatever force it is sent. For tests and for
// measurements without a person. Thread rule: as HapticDevice.
#pragma once

#include "device/haptic_device.h"

#include <cstddef>
#include <vector>

namespace filiform {

struct ScriptedPoint {
  double time_s = 0;
  Eigen::Vector3d p_D = Eigen::Vector3d::Zero();  // m
  std::uint32_t buttons = 0;                      // held from this point to the next
};

// Moves in straight lines at constant speed and is exactly at a point at its time. At rest before the first point and
// after the last.
class ScriptedPath : public HapticDevice {
 public:
  // Throws DeviceError if there is no point, times do not increase strictly from >= 0, or a value is not finite.
  explicit ScriptedPath(std::vector<ScriptedPoint> points, double period_s = 0.001);

  // True after an exchange has reported the last point.
  bool finished() const noexcept { return state_.time_s >= points_.back().time_s; }
  // The last wrench as a device would render it: zero if it was not finite or the status was not ready.
  const Wrench& lastWrench() const noexcept { return last_wrench_; }

  const DeviceCapabilities& capabilities() const override { return capabilities_; }
  DeviceStatus status() const noexcept override { return state_.status; }
  // Restarts at time 0.
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
  std::size_t next_ = 0;  // the first point with a later time
  DeviceState state_;
  Wrench last_wrench_;
};

}  // namespace filiform
