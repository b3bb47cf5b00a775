// HapticDevice: the common interface of haptic devices, 3D mice, recordings and simulated hands: exchange(wrench) ->
// state.
//
// Frame D: metres, newtons, seconds; x right, y up, z out of the device towards the person; origin at the centre of the
// workspace. Thread rule: after open(), one thread (the haptic one) calls exchange(); the owner's thread calls the
// rest.
#pragma once

#include "index/error.h"

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace filiform {

// A device that cannot be opened or has failed permanently; the text says what to do. Exit code 3.
class DeviceError : public Error {
 public:
  using Error::Error;
};

// A device or hand name that this build does not know; the text lists the known names. Exit code 2.
class UnknownDevice : public DeviceError {
 public:
  // `given` and `known`: the unknown name and the known ones, so that a program can suggest near names.
  explicit UnknownDevice(const std::string& what, std::string given = "", std::vector<std::string> known = {})
      : DeviceError(what), given_(std::move(given)), known_(std::move(known)) {}
  const std::string& given() const noexcept { return given_; }
  const std::vector<std::string>& known() const noexcept { return known_; }

 private:
  std::string given_;
  std::vector<std::string> known_;
};

// Whether a device can be used; toString() gives the enumerator's name.
enum class DeviceStatus : std::uint8_t { closed, booting, homing, ready, fault };
const char* toString(DeviceStatus status);

// Properties of a device, constant after open().
struct DeviceCapabilities {
  std::string name;
  Eigen::Vector3d workspace_lo_D{-0.06, -0.06, -0.06};  // m
  Eigen::Vector3d workspace_hi_D{0.06, 0.06, 0.06};     // m
  double peak_force_N = 0;                              // 0: renders no force
  double continuous_force_N = 0;                        // 0: unknown
  double max_stiffness_N_m = 0;                         // 0: unknown
  double damping_Ns_m = 0;                              // the device's own viscous damping; 0: unknown
  double resolution_m = 0;                              // of the position; 0: continuous
  double nominal_rate_Hz = 1000;
  int delay_samples = 0;  // from a commanded force to its effect in the state
  int buttons = 0;
  bool senses_rotation = false;     // twist_D
  bool senses_orientation = false;  // orientation_D
  bool rate_control = false;        // senses no position: p_D stays 0, v_D and twist_D are the commanded rates
  bool needs_homing = false;
  bool paces_loop = false;     // exchange() blocks until the next sample
  bool keeps_time = false;     // moves in real time, whether or not exchange() is called: not for virtual time
  bool is_led = false;         // a simulated hand elsewhere, which follows lead()
  bool renders_model = false;  // renders Wrench::model between two exchanges
};

// How a force changes while the hand moves, until the next exchange:
//
//   f(x, v) = force_N - K (x - at_D) - b v          |x - at_D| > radius_m: x - at_D is shortened to radius_m
//
// K is symmetric without negative eigenvalue: a spring, so within one model the force gives no more energy than it took
// as long as x stays within the radius. Without K and b the force is constant.
struct LocalModel {
  Eigen::Vector3d at_D = Eigen::Vector3d::Zero();           // m, frame D: the hand when the force was computed
  Eigen::Matrix3d stiffness_N_m = Eigen::Matrix3d::Zero();  // K
  double damping_Ns_m = 0;                                  // b, >= 0
  double radius_m = 0;                                      // >= 0
  double time_to_live_s = 0.02;                             // > 0; then the force fades
};

// True for a model whose numbers are finite, in range, and a spring as above; rounding of 1e-9 is allowed for.
bool isSpring(const LocalModel& model) noexcept;

// A commanded force and torque.
struct Wrench {
  Eigen::Vector3d force_N = Eigen::Vector3d::Zero();    // frame D
  Eigen::Vector3d torque_Nm = Eigen::Vector3d::Zero();  // frame D
  LocalModel model{};                                   // of force_N; devices without renders_model ignore it
  // How much the neurite resists, 0 .. 1, for devices that rumble instead of a force.
  double resistance = 0;
};

// Returns the wrench if every component is finite, otherwise zero. A model that is not a spring is left out, and the
// resistance is limited to 0 .. 1. Every device renders this value.
Wrench finiteOrZero(const Wrench& wrench) noexcept;

// Turns the stylus from its rest, where its shaft points towards the person (+z), into its orientation in frame D. Unit
// length. Without Eigen's alignment, so that states can be stored anywhere.
using Orientation = Eigen::Quaternion<double, Eigen::DontAlign>;

struct DeviceState {                                  // one consistent snapshot
  double time_s = 0;                                  // time of the sample on the device's clock, from open()
  Eigen::Vector3d p_D = Eigen::Vector3d::Zero();      // m
  Eigen::Vector3d v_D = Eigen::Vector3d::Zero();      // m/s, as the device estimates it
  Eigen::Vector3d twist_D = Eigen::Vector3d::Zero();  // rad/s about x, y, z; zero unless senses_rotation
  Orientation orientation_D{1, 0, 0, 0};              // of the stylus; the identity unless senses_orientation
  std::uint32_t buttons = 0;                          // bit i: button i held
  DeviceStatus status = DeviceStatus::closed;
  // Force (N, frame D) that this exchange sent to the motors, after all limits of the device. nullopt: the device does
  // not report it; the caller then assumes the force of the wrench.
  std::optional<Eigen::Vector3d> sent_N;
};

class HapticDevice {
 public:
  virtual ~HapticDevice() = default;

  virtual const DeviceCapabilities& capabilities() const = 0;
  virtual DeviceStatus status() const noexcept = 0;

  // Opens the device; it becomes ready at once or after homing. May block for seconds. Throws DeviceError.
  virtual void open() = 0;
  // Sends zero force and closes the device. Safe in any state and more than once.
  virtual void close() noexcept = 0;

  // Commands a wrench and returns the newest state. Force is rendered only while status() is ready; a wrench that is
  // not finite is rendered as zero. If the device limits, ramps or drops the force, DeviceState::sent_N says so. A lost
  // device returns its last state with status fault. Does not allocate; blocks only if capabilities().paces_loop. A
  // bridge waits at most 2 ms for its answer, a device process 6 ms, the Haply service 5 ms (bridge/bridge_device.h,
  // process/process_device.h, haply/haply_device.h).
  virtual DeviceState exchange(const Wrench& wrench) noexcept = 0;
  // Commands zero force without returning a state: for shutdown, and while no force is computed. Otherwise as
  // exchange().
  virtual void relax() noexcept { exchange(Wrench{}); }
  // If capabilities().is_led: the simulated hand pulls towards this point (m, frame D) from the next exchange on. Other
  // devices ignore it. The thread that calls exchange() calls it.
  virtual void lead(const Eigen::Vector3d& /*target_D*/) noexcept {}

  // Tells the person why the device is not ready or was lost, and the remedy. Returns a static text, empty if the
  // device has nothing to say. Any thread may call it.
  virtual const char* advice() const noexcept { return ""; }
};

}  // namespace filiform
