// 3Dconnexion mice: a cap that is pushed and turned, and buttons. It senses no position and renders no force: p_D rests
// at 0, v_D and twist_D are the rates that the hand asks for (capabilities().rate_control). solver/rate_control.h makes
// a probe of them.
//
// Frame D out of the cap's axes: x right, y up, z towards the person. Both report formats are understood, wired or over
// a receiver (one of its mice at a time). Thread rule: as HapticDevice.
#pragma once

#include "device/haptic_device.h"
#include "device/usb_transport.h"

#include <memory>
#include <string>

namespace filiform {

struct SpaceMouseOptions {
  std::string bus_path = {};    // which one, as `filiform devices` names it; empty: the first
  double full_speed_m_s = 0.1;  // at full deflection
  double full_turn_rad_s = 1;   // at full deflection
  double dead_zone = 0.02;      // of full deflection, on each axis: taken as rest
  double silence_s = 0.1;       // without a report of motion it is at rest: a mouse at rest says nothing
};

// A 6-axis mouse or the receiver of one, by its ids.
bool isSpaceMouse(const UsbDeviceInfo& info);

class SpaceMouse : public HapticDevice {
 public:
  // The transport must outlive it. Throws DeviceError for speeds or times that are not finite and > 0, or a dead zone
  // outside 0..0.9.
  explicit SpaceMouse(UsbTransport& transport, const SpaceMouseOptions& options = {});
  ~SpaceMouse() override;

  const DeviceCapabilities& capabilities() const override { return capabilities_; }
  DeviceStatus status() const noexcept override;
  // Takes its HID interfaces from the kernel (other programs lose it until close()), and lights its LED. Throws
  // UsbError not_found, no_permission, busy. Ready at once; also after a fault, when it is plugged in again.
  void open() override;
  // Gives the interfaces back.
  void close() noexcept override;
  // The newest rates; never waits. Fault once it is unplugged: at rest, no button held.
  DeviceState exchange(const Wrench& wrench) noexcept override;

  std::uint64_t reports() const noexcept;  // of motion and buttons, since open()

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
