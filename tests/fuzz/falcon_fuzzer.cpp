#include "device/falcon/falcon.h"
#include "device/falcon/falcon_protocol.h"
#include "tests/fuzz/fuzz_bytes.h"
#include "tests/support/devices/fake_falcon.h"

#include <cmath>

namespace filiform::fuzz {
namespace {

void parse(Input input) {
  FalconReportParser parser;
  forEachFtdiPayload(input, [&](Input payload) {
    for (const std::uint8_t byte : payload) {
      if (!parser.push(byte)) continue;
      require(parser.report().buttons < 16 && parser.report().homed < 8, "buttons and marks are those there are");
    }
  });
  require(parser.reports() * kFalconPacketBytes + parser.skipped_bytes() <= input.size(), "bytes are counted once");
}

void loadFirmware(Input input) {
  static const std::vector<std::uint8_t> image(kFalconFirmwareLeast, 0x55);
  FalconLoader loader(image, 2);
  Taker in(input);
  double time_s = 0;
  for (int steps = 0;; ++steps) {
    require(steps < 4000, "loading comes to an end");
    const FalconLoader::Step& step = loader.next(time_s);
    time_s += 0.01;
    if (step.action == FalconLoader::Action::loaded || step.action == FalconLoader::Action::failed) return;
    if (step.action != FalconLoader::Action::read) continue;
    const auto length = in.number<std::uint8_t>();
    if (length == 255) loader.lost("pulled out");
    loader.received(in.some(length % 64));
  }
}

// A device that behaves as a Falcon until it is homed, and then sends any bytes.
void drive(Input input) {
  test::FakeUsb usb;
  usb.queue_packets = 64;  // cheap to set up
  test::FakeFalcon fake(usb);
  Falcon falcon(usb);
  fake.powerUp(true);
  falcon.open();
  falcon.exchange({});
  fake.home();
  falcon.exchange({});
  Taker in(input);
  fake.usb_device().on_write = [&](std::uint8_t, std::span<const std::uint8_t>, test::FakeUsbDevice& device) {
    const Input answer = in.some(in.number<std::uint8_t>() % 80);
    if (!answer.empty()) device.answer(0x81, answer, 1e-3);
  };
  Wrench push;
  push.force_N = {1, -2, 3};
  for (int i = 0; i < 64 && !in.empty(); ++i) {
    const DeviceState state = falcon.exchange(push);
    require(state.p_D.allFinite() && state.v_D.allFinite() && std::isfinite(state.time_s), "states are finite");
    require(state.p_D.norm() < 0.3 && state.v_D.norm() < 50, "the grip is where a grip can be");
  }
  falcon.close();
  require(usb.violations().empty(), "USB is used as it may be");
}

}  // namespace

void fuzzFalcon(Input input) {
  Taker in(input);
  const auto kind = in.number<std::uint8_t>() % 3;
  if (kind == 0) parse(in.rest());
  if (kind == 1) loadFirmware(in.rest());
  if (kind == 2) drive(in.rest());
}

}  // namespace filiform::fuzz
