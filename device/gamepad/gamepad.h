// Driver of gamepads: rates instead of a position, and rumble instead of a force.
//
//   Gamepad pad({.path = "/dev/input/event7"});
//   pad.open();
//   const DeviceState state = pad.exchange(wrench);   // rumbles with wrench.resistance
//
// The left stick pulls to the right and up, the right trigger away from the person, the left one closer. The right
// stick turns the scene. Buttons: bit 0 south (A, cross), 1 east, 2 right shoulder, 3 left shoulder, 4 north, 5 west, 6
// select, 7 start. An exchange reads the events that wait and never blocks. The rumble ends by itself 0.2 s after the
// last exchange. Thread rule: as HapticDevice.
//
// Nothing of this was tried on a real gamepad: HARDWARE.md lists what is to be tested.
#pragma once

#include "device/gamepad/gamepad_port.h"
#include "device/haptic_device.h"

#include <array>
#include <functional>
#include <memory>
#include <string>

namespace filiform {

struct GamepadOptions {
  std::string path{};            // of the device node; empty: the first gamepad that may be opened
  double full_speed_m_s = 0.05;  // at full deflection of a stick or trigger
  double full_turn_rad_s = 1.5;  // at full deflection of the right stick
  double dead_zone = 0.15;       // part of the deflection that counts as rest
  // Opens the port. Empty: openGamepad().
  std::function<std::unique_ptr<GamepadPort>(const std::string& path)> connect{};
  std::function<double()> clock{};  // s; empty: the system's steady clock
};

class Gamepad : public HapticDevice {
 public:
  static constexpr double kRumblePeriod_s = 0.05;  // the rumble changes at most so often

  // Throws DeviceError for an option that is out of range.
  explicit Gamepad(GamepadOptions options = {});
  ~Gamepad() override;

  const DeviceCapabilities& capabilities() const override;
  DeviceStatus status() const noexcept override;
  // Throws DeviceError if there is no gamepad, or none that may be opened.
  void open() override;
  void close() noexcept override;
  DeviceState exchange(const Wrench& wrench) noexcept override;
  bool rumbles() const noexcept;  // after open()

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform
