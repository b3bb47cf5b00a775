// Driver of the Haply Inverse3 through the Haply Inverse Service: three force components; position, buttons and
// orientation of the grip, of the first VerseGrip in the list.
//
//   HaplyDevice haply(haplyOptions(",049D"));
//   haply.open();                                      // homing, until the service says that the device is ready
//   const DeviceState state = haply.exchange(wrench);  // one message to the service, one state back
//
// The service runs on this or another machine. It sends exactly one state for each message. A session begins with these
// steps: ask for the service's version, read the list of devices, time kMeasured exchanges without force, and prove the
// force. The service silently ignores a command with an unknown name, and the name differs between versions. So the
// driver commands kProbe_N upwards, and looks for it in the force that the state reports. If it does not appear, the
// driver tries the other name. Other forces begin only after this proof.
//
// Safety rules, tested against a simulated service with faults:
//   - no force before the device is calibrated and ready, and before the proof
//   - the force grows from zero during ramp_s after the proof, after a gap and after a jump of the position
//   - kStale_s after the last state, the device is sent zero; after kLost_s, the status is fault
//   - if the states do not report a commanded force for kUnproven states, the force ends and the proof is repeated
//   - close() and a fault send zero several times, as far as the service takes it
// An exchange ends within 0.010 s: kAnswerTime_s, and the zeros of a fault. Thread rule: as HapticDevice; advice() on
// any thread.
//
// Nothing of this was tried on a real device: HARDWARE.md lists what is to be tested.
#pragma once

#include "device/device_gate.h"
#include "device/haptic_device.h"
#include "device/web_socket/byte_stream.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

namespace filiform {

// HOST:PORT of the service for names that state none.
inline constexpr const char* kHaplyServiceVariable = "FILIFORM_HAPLY_SERVICE";

struct HaplyOptions {
  std::string host = "127.0.0.1";
  std::uint16_t port = 10001;
  std::string id{};  // of the device, as the service writes it; empty: the only one
  // Position (m) in the service's frame that is the centre of the workspace. x right, y away from the person, z up;
  // origin on the mounting plate. From the example of a state in Haply's documentation.
  Eigen::Vector3d centre_H{0, -0.12, 0.15};
  double ramp_s = 0.5;
  double most_rate_Hz = 4000;  // exchanges wait until this rate is kept
  double timeout_s = 2;        // of each step of open()
  // Makes a connection to the service. Empty: by TCP, to host and port.
  std::function<std::unique_ptr<ByteStream>()> connect{};
};

// Reads what follows "haply" in a device's name: "", ":HOST:PORT", ",ID" or ":HOST:PORT,ID". Without host and port, the
// environment variable kHaplyServiceVariable may state them. Throws UnknownDevice.
HaplyOptions haplyOptions(const std::string& argument);

struct HaplyCounters {  // since open()
  std::uint64_t messages = 0, states = 0;
  std::uint64_t unanswered = 0;  // exchanges without a state in time
  std::uint64_t unreadable = 0;  // messages that are no state of this device
  std::uint64_t jumps = 0;       // positions that the hand cannot have reached
};

// How fast the service answers, measured while no force acts.
struct HaplyTransport {
  double period_s = 0;       // of exchanges, the median
  double slow_period_s = 0;  // which nine of ten exchanges keep
  int delay_states = 0;      // from a commanded force to the state that reports it; 0: the answer to the command
  double stiffness_N_m = 0;  // the largest that follows: see haplyStiffness()
  const char* dialect = "";  // "vector" or "values", once proven
  std::string version{};     // as the service states it
};

// The largest stiffness (N/m) for exchanges of this period, and a force that acts `delay_samples` exchanges after its
// command: the bound of solver/FORCES.md for kAssumedDamping_Ns_m, at most kMostStiffness_N_m.
double haplyStiffness(double period_s, int delay_samples) noexcept;

class HaplyDevice : public HapticDevice {
 public:
  static constexpr double kAnswerTime_s = 0.005;
  static constexpr double kStale_s = DeviceGate::kStale_s;
  static constexpr double kLost_s = 0.25;
  static constexpr double kProbe_N = 0.02;
  static constexpr double kMostForce_N = 3;            // no source states the device's own limit
  static constexpr double kMostSpeed_m_s = 4;          // of the hand; faster is a jump
  static constexpr double kAssumedDamping_Ns_m = 0.5;  // of device and hand together, at least
  static constexpr double kMostStiffness_N_m = 500;
  static constexpr double kLeastStiffness_N_m = 20;  // a service too slow for this is refused
  static constexpr int kMeasured = 200;
  static constexpr int kProofStates = 40;
  static constexpr int kUnproven = 200;
  static constexpr int kZeroMessages = 3;

  // Throws DeviceError if a time or rate is not finite and > 0, or if the id cannot be one.
  explicit HaplyDevice(HaplyOptions options = {});
  ~HaplyDevice() override;

  // Begins a session. Returns with status homing if the device is not ready yet; exchange() then goes on. Throws
  // DeviceError, with the reason and what to do, if: the service does not run or is none; no device is connected, or
  // not the one named; several are connected and none is named; the service answers too slowly for force; neither name
  // of the command has an effect.
  void open() override;
  void close() noexcept override;
  const DeviceCapabilities& capabilities() const override;
  DeviceStatus status() const noexcept override;
  // Sends the force and waits at most kAnswerTime_s for the state. Without one, returns the last state with its time
  // unchanged. Ignores torques.
  DeviceState exchange(const Wrench& wrench) noexcept override;
  // Only a simulated service has a hand that follows (capabilities().is_led).
  void lead(const Eigen::Vector3d& target_D) noexcept override;
  const char* advice() const noexcept override;

  const HaplyCounters& counters() const noexcept;
  const HaplyTransport& transport() const noexcept;  // constant after open(); the dialect, once the status is ready

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform
