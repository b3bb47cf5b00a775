// The long test of a device: workspace, gravity, springs, damping and a sweep of stiffness, all with a small force. It
// runs on the haptic thread, after DeviceChecker.
// Thread rule: tick() on the haptic thread; phase() and over() on any thread; found() after over() is true or the loop
// has ended.
#pragma once

#include "device/haptic_device.h"

#include <array>
#include <atomic>
#include <cstdint>
#include <vector>

namespace filiform::tools {

struct DeviceWalkOptions {
  double workspace_s = 8;       // the person moves the handle
  double gravity_s = 2;         // the handle rests, without force
  double spring_s = 1;          // each axis
  double damping_s = 4;         // the person moves the handle
  double sweep_s = 0.6;         // each stiffness
  double pause_s = 1.5;         // without force before each part after the first: the person reads what comes
  double force_N = 0.5;         // no force is longer
  double spring_N_m = 50;       // of the springs
  double offset_m = 0.01;       // from the handle to the end of a spring, once it is stretched
  double damping_Ns_m = 1;      // of the damper
  double most_moved_m = 0.025;  // a spring and the sweep end if the handle moves farther
};

struct DeviceWalkFound {
  Eigen::Vector3d lo_D = Eigen::Vector3d::Zero(), hi_D = Eigen::Vector3d::Zero();  // m, of the workspace
  Eigen::Vector3d drift_m = Eigen::Vector3d::Zero();                               // of the resting handle
  double fastest_drift_m_s = 0;
  struct Spring {
    double moved_m = 0, force_N = 0;  // at its end, along its axis
    bool stopped = false;             // the handle moved too far
  };
  std::array<Spring, 3> springs;
  double damped_J = 0;  // energy that the damper took from the hand, by the forces that were really sent
  double fastest_damped_m_s = 0;
  struct Step {
    double stiffness_N_m = 0, speed_m_s = 0;  // mean (rms) speed in the second half
    int reversals = 0;                        // of the motion, in the second half
    bool vibrates = false;
  };
  std::vector<Step> sweep;     // ends with the first stiffness that vibrates
  bool sweep_stopped = false;  // the handle moved too far
};

class DeviceWalk {
 public:
  enum class Phase : std::uint8_t { workspace, gravity, springs, damping, sweep, over };

  // The sweep doubles the stiffness from 25 N/m up to `most_N_m`. If the device renders no force, the walk ends after
  // the workspace.
  DeviceWalk(const DeviceWalkOptions& options, bool renders_force, double most_N_m);

  // Returns the force to render. O(1), no allocation.
  Wrench tick(const DeviceState& state, double dt_s) noexcept;

  Phase phase() const noexcept { return phase_.load(std::memory_order_acquire); }
  bool over() const noexcept { return phase() == Phase::over; }
  const DeviceWalkFound& found() const noexcept { return found_; }

 private:
  void begin(Phase phase) noexcept;
  bool movedTooFar(const DeviceState& state) const noexcept;
  Eigen::Vector3d stretch(const DeviceState& state) noexcept;
  Eigen::Vector3d damp(const DeviceState& state) noexcept;
  Eigen::Vector3d hold(const DeviceState& state, double dt_s) noexcept;

  const DeviceWalkOptions options_;
  const bool renders_force_;
  DeviceWalkFound found_;
  std::atomic<Phase> phase_{Phase::workspace};
  double elapsed_s_ = 0, pause_left_s_ = 0;
  bool first_ = true;  // state of a part
  Eigen::Vector3d start_D_ = Eigen::Vector3d::Zero(), last_D_ = Eigen::Vector3d::Zero();
  std::size_t axis_ = 0, step_ = 0;
  double squares_ = 0, seconds_ = 0;  // of the speed in the sweep
  Eigen::Vector3d sign_ = Eigen::Vector3d::Zero();
};

}  // namespace filiform::tools
