// BridgeDevice: a device behind a bridge, a separate program that links a vendor's library (device/BRIDGE.md,
// tools/bridges). Each exchange sends one COMMAND and waits for its STATE.
//
// The constructor connects, so capabilities are known before open(). No force is rendered before open(). The bridge
// itself limits the force, and lets it fade if no COMMAND comes. Thread rule: as HapticDevice.
#pragma once

#include "device/haptic_device.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace filiform {

struct BridgeOptions {
  // Path of a socket, or udp:HOST:PORT with an address of this machine. Empty: the only bridge in bridgeFolder().
  std::string address{};
  // File with the 32 hexadecimal digits that the bridge at a port wants. Empty: FILIFORM_BRIDGE_COOKIE, or "cookie" in
  // bridgeFolder().
  std::string cookie_file{};
  double period_s = 0.001;  // of the exchanges; with the round trip it gives capabilities().delay_samples
  double answer_s = 0.002;  // an exchange waits so long for its STATE
  double silence_s = 0.25;  // a COMMAND without a STATE for so long: the status is fault
  double connect_s = 1;     // the constructor waits so long for the bridge
  int round_trips = 64;     // measured by the constructor
  // Makes a connected socket to a bridge that serves nobody else; called to connect and to connect again. Throws
  // DeviceError. Empty: connects to `address`, which otherwise is only the name in error messages.
  std::function<int()> connect{};
};

struct BridgeCounters {  // since the constructor
  std::uint64_t commands = 0, states = 0;
  std::uint64_t unanswered = 0;  // exchanges that returned without their STATE
  std::uint64_t strange = 0;     // packets that are not one of the protocol's, repeat an older one, or are not finite
  std::uint64_t refused = 0;     // commands that the bridge refused, as it counts
};

class BridgeDevice : public HapticDevice {
 public:
  // Connects and measures round trips. Throws DeviceError if no bridge answers, if it serves another program, or if
  // its description is not valid.
  explicit BridgeDevice(const BridgeOptions& options);
  ~BridgeDevice() override;

  const DeviceCapabilities& capabilities() const override;
  DeviceStatus status() const noexcept override;
  // Asks the bridge to arm; connects again if the bridge was lost. The status is ready when a STATE says that the
  // device is. Throws as the constructor does.
  void open() override;
  // Sends zero force and says good-bye. Another program may then use the bridge.
  void close() noexcept override;
  // Waits at most answer_s. The bridge renders Wrench::model at its own rate, with a stiffness of at most
  // max_stiffness_N_m, and for at most 20 ms. DeviceState::sent_N is the force that the bridge rendered at the time of
  // the state; from then on a spring gives no more energy than this force would. After an expiry the next exchange asks
  // the bridge to arm again; the bridge then ramps the force.
  DeviceState exchange(const Wrench& wrench) noexcept override;
  void lead(const Eigen::Vector3d& target_D) noexcept override;
  const char* advice() const noexcept override;  // of the bridge

  // Measured by the constructor: median and largest time from COMMAND to STATE.
  double typicalRoundTrip_s() const noexcept;
  double longestRoundTrip_s() const noexcept;
  BridgeCounters counters() const noexcept;
  // Whether the status is fault because of silence_s; otherwise the bridge ended, or said that the device is lost. The
  // thread that calls exchange().
  bool isSilent() const noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform
