// SpaceMouse: a 3Dconnexion mouse, with a cap to push and turn, and buttons. It senses no position and renders no
// force. p_D stays 0; v_D and twist_D are the rates that the person commands (capabilities().rate_control).
// solver/workspace/rate_control.h integrates them to a probe.
//
// The cap's axes are converted to frame D: x right, y up, z towards the person. Reads both report formats, by cable or
// receiver (one mouse of a receiver at a time). Thread rule: as HapticDevice.
#pragma once

#include "device/haptic_device.h"
#include "device/usb/usb_transport.h"

#include <memory>
#include <string>

namespace filiform {

struct SpaceMouseOptions {
  std::string bus_path = {};    // USB socket as `filiform devices` prints it; empty: the first mouse
  double full_speed_m_s = 0.1;  // at full deflection
  double full_turn_rad_s = 1;   // at full deflection
  double dead_zone = 0.02;      // fraction of full deflection that counts as rest, on each axis
  double silence_s = 0.1;       // rest is assumed after this time without a motion report: mice at rest send none
};

// True for 6-axis mice and their receivers, by USB ids.
bool isSpaceMouse(const UsbDeviceInfo& info);

class SpaceMouse : public HapticDevice {
 public:
  // The transport must outlive this object. Throws DeviceError if a speed or time is not finite and > 0, or if the dead
  // zone is outside 0..0.9.
  explicit SpaceMouse(UsbTransport& transport, const SpaceMouseOptions& options = {});
  ~SpaceMouse() override;

  const DeviceCapabilities& capabilities() const override { return capabilities_; }
  DeviceStatus status() const noexcept override;
  // Takes the mouse's HID interfaces from the kernel and switches on its LED. Other programs cannot use the mouse until
  // close(). Ready at once; also reopens a mouse that was unplugged and plugged in again. Throws UsbError not_found,
  // no_permission, busy.
  void open() override;
  // Returns the interfaces to the kernel.
  void close() noexcept override;
  // Returns the newest rates; never waits. If unplugged: status fault, zero rates, no buttons.
  DeviceState exchange(const Wrench& wrench) noexcept override;

  std::uint64_t reports() const noexcept;  // number of motion and button reports since open()

 private:
  struct Connected;
  void light(bool on) noexcept;
  UsbTransport& transport_;
  SpaceMouseOptions options_;
  DeviceCapabilities capabilities_;
  DeviceState state_;
  std::unique_ptr<Connected> connected_;
};

}  // namespace filiform
