// ProcessDevice: a device whose driver runs in a process of its own, `filiform-device`, behind a private socket.
//
// If this program dies or stops, the device process lets the force fade (device/BRIDGE.md): zero 70 ms after the last
// command. If the device process dies, loses its device, or does not answer for kSilence_s, a thread of this object
// opens the device again and sends zero (device/README.md, "Zero force"); first it kills a process that is silent, or
// that does not end within 0.2 s. The status is then fault; open() starts again. Thread rule: as HapticDevice.
#pragma once

#include "device/haptic_device.h"

#include <cstdint>
#include <memory>
#include <string>

namespace filiform {

struct ProcessDeviceOptions {
  std::string device;     // as makeDevice() takes it, without ",direct"
  std::string program{};  // of the device process; empty: filiform-device beside this program, or else in PATH
  double period_s = 0.001;
};

struct ProcessRescues {      // of device processes that died or did not answer
  std::uint64_t begun = 0;   // killed, if they still ran
  std::uint64_t zeroed = 0;  // the device was opened again and took zero
};

class ProcessDevice : public HapticDevice {
 public:
  static constexpr double kSilence_s = 0.15;
  static constexpr double kAnswer_s = 0.006;  // longer than the longest exchange of a driver, 5 ms

  // Starts the process, which opens the device: so capabilities are known before open(). Throws DeviceError, with the
  // driver's reason, if the device cannot be opened; also if the program is not there.
  explicit ProcessDevice(ProcessDeviceOptions options);
  ~ProcessDevice() override;

  const DeviceCapabilities& capabilities() const override;
  DeviceStatus status() const noexcept override;
  // Starts the process again after a fault. Throws as the constructor does.
  void open() override;
  // Sends zero and waits for the process to end: at most 0.5 s if it answered, 0.15 s if not, and 0 s after a silence.
  // Kills a process that still runs; another one then sends zero (at most 3 s).
  void close() noexcept override;
  // As BridgeDevice::exchange(). Waits for the device's next sample, at most kAnswer_s. If the first thread that calls
  // it after open() has real-time priority, that thread and the process stay on the core where it runs.
  DeviceState exchange(const Wrench& wrench) noexcept override;
  void lead(const Eigen::Vector3d& target_D) noexcept override;
  const char* advice() const noexcept override;

  int processId() const noexcept;           // of the device process; -1: none runs
  ProcessRescues rescues() const noexcept;  // any thread

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform
