// One interface for everything a hand may hold, or that stands in for a hand: exchange(wrench) -> state.
//
// Frame D: metres, newtons, seconds; x to the right, y up, z out of the device towards the person; origin at the centre
// of the workspace. Thread rule: after open(), exchange() is for one thread (the haptic one); the rest for the thread
// that owns it.
#pragma once

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>

#include <Eigen/Core>

namespace filiform {

// A device that cannot be opened or has failed for good; the text says what to do. Exit code 3.
class DeviceError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// A name that this build has no device or hand for; the text names those that it has. Exit code 2.
class UnknownDevice : public DeviceError {
 public:
  using DeviceError::DeviceError;
};

enum class DeviceStatus : std::uint8_t { closed, booting, homing, ready, fault };
const char* toString(DeviceStatus status);

struct DeviceCapabilities {
  std::string name;
  Eigen::Vector3d workspace_lo_D{-0.06, -0.06, -0.06};  // m
  Eigen::Vector3d workspace_hi_D{0.06, 0.06, 0.06};     // m
  double peak_force_N = 0;                              // 0: it renders no force
  double continuous_force_N = 0;                        // 0: unknown
  double max_stiffness_N_m = 0;                         // 0: unknown
  double damping_Ns_m = 0;                              // the device's own viscous damping; 0: unknown
  double resolution_m = 0;                              // of the position; 0: continuous
  double nominal_rate_Hz = 1000;
  int delay_samples = 0;  // between a force commanded and its effect in the state
  int buttons = 0;
  bool senses_rotation = false;
  bool rate_control = false;  // it has no position: p_D rests, v_D and twist_D are rates that the hand asks for
  bool needs_homing = false;
  bool paces_loop = false;  // exchange() itself blocks until the next sample
};

struct Wrench {
  Eigen::Vector3d force_N = Eigen::Vector3d::Zero();    // frame D
  Eigen::Vector3d torque_Nm = Eigen::Vector3d::Zero();  // frame D
};

// The wrench itself if every component is finite, else zero: what every device must render.
Wrench finiteOrZero(const Wrench& wrench) noexcept;

struct DeviceState {                                  // one consistent snapshot
  double time_s = 0;                                  // of the sample, device clock, from open()
  Eigen::Vector3d p_D = Eigen::Vector3d::Zero();      // m
  Eigen::Vector3d v_D = Eigen::Vector3d::Zero();      // m/s, as the device estimates it
  Eigen::Vector3d twist_D = Eigen::Vector3d::Zero();  // rad/s about x, y, z; zero unless senses_rotation
  std::uint32_t buttons = 0;                          // bit i: button i held
  DeviceStatus status = DeviceStatus::closed;
  // The force (N, frame D) that this exchange sent to the motors, after every limit of the device. None: the device
  // does not say; it is then taken to have sent the force of the wrench.
  std::optional<Eigen::Vector3d> sent_N;
};

class HapticDevice {
 public:
  virtual ~HapticDevice() = default;

  virtual const DeviceCapabilities& capabilities() const = 0;
  virtual DeviceStatus status() const noexcept = 0;

  // Brings the device to `ready` or on its way there. Throws DeviceError. May block for seconds.
  virtual void open() = 0;
  // Zero force, then closed. Never throws; safe in any state, more than once.
  virtual void close() noexcept = 0;

  // Commands the wrench and returns the newest state. No force is rendered unless status() is ready. A wrench that is
  // not finite is rendered as zero. A device that limits, ramps or drops the force reports it in DeviceState::sent_N.
  // noexcept, no allocation; blocks only if capabilities().paces_loop. A lost device returns the last state with status
  // fault.
  virtual DeviceState exchange(const Wrench& wrench) noexcept = 0;
  // Zero force now, and no state: what is sent on the way out, and while nobody computes a force. As exchange().
  virtual void relax() noexcept { exchange(Wrench{}); }
};

}  // namespace filiform
