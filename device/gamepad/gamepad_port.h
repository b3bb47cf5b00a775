// One gamepad of the kernel's input system (evdev): its events, the ranges of its axes, and its rumble. GamepadPort is
// the seam that tests replace. Sources: the kernel's Documentation/input (event-codes.rst, gamepad.rst, ff.rst).
// Thread rule: one thread.
#pragma once

#include "device/haptic_device.h"

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace filiform {

struct GamepadEvent {  // numbers as in linux/input-event-codes.h
  std::uint16_t type = 0, code = 0;
  std::int32_t value = 0;
};

class GamepadPort {
 public:
  struct Range {
    double lo = -32768, hi = 32767;
  };
  virtual ~GamepadPort() = default;

  virtual bool rumbles() const noexcept = 0;
  virtual Range range(std::uint16_t axis) const noexcept = 0;  // of ABS_X .. ABS_RZ (0 .. 5)
  // Reads the events that wait. Returns their number, 0 if there are none, -1 if the gamepad is lost. Never blocks;
  // does not allocate.
  virtual int read(std::span<GamepadEvent> events) noexcept = 0;
  // Rumbles with a strength of 0 .. 1 for at most 0.2 s. False: the gamepad does not take it. Does not allocate.
  virtual bool rumble(double strength) noexcept = 0;
};

struct FoundGamepad {
  std::string path;  // /dev/input/eventN
  std::string name;
  bool rumbles = false;
  bool may_open = false;
};
// The gamepads of the system, by number. `sys` and `dev`: folders of the kernel's lists and of the device nodes.
std::vector<FoundGamepad> findGamepads(const std::string& sys = "/sys/class/input",
                                       const std::string& dev = "/dev/input");

// Opens a device node. Throws DeviceError.
std::unique_ptr<GamepadPort> openGamepad(const std::string& path);

}  // namespace filiform
