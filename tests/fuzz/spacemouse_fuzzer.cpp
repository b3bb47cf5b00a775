#include "device/spacemouse/internal/spacemouse_reports.h"
#include "device/spacemouse/spacemouse.h"
#include "tests/fuzz/fuzz_bytes.h"
#include "tests/support/devices/fake_usb.h"

#include <cmath>

namespace filiform::fuzz {

// Reports, each preceded by its length.
void fuzzSpaceMouse(Input input) {
  Taker reports(input);
  internal::SpaceMouseState taken;
  while (!reports.empty()) {
    internal::takeReport(reports.some(reports.number<std::uint8_t>() % 32), taken);
    for (const double axis : taken.axes) require(axis >= -1 && axis <= 1, "axes lie in -1..1");
  }

  test::FakeUsb usb;
  usb.queue_packets = 64;  // enough, and cheap to set up
  UsbDeviceInfo info;
  info.vendor = 0x046d;
  info.product = 0xc626;
  info.bus_path = "1-1";
  info.interfaces = {{0, 3, 0, 0, {{0x81, UsbEndpointType::interrupt, 8}}}};
  test::FakeUsbDevice& device = usb.plug(info);
  const SpaceMouseOptions options;
  SpaceMouse mouse(usb, options);
  mouse.open();
  Taker in(input);
  for (int i = 0; i < 64 && !in.empty(); ++i) {
    const Input report = in.some(in.number<std::uint8_t>() % 32);
    if (!report.empty()) device.answer(0x81, report);
    usb.pause(0.004);
    const DeviceState state = mouse.exchange({});
    require(state.p_D.isZero() && state.v_D.norm() <= 1.8 * options.full_speed_m_s &&
                state.twist_D.norm() <= 1.8 * options.full_turn_rad_s,
            "rates are at most those of full deflection on each axis");
  }
  mouse.close();
  require(usb.violations().empty(), "USB is used as it may be");
}

}  // namespace filiform::fuzz
