#include "device/gamepad/gamepad.h"

#include "tests/support/no_alloc_guard.h"
#include "tests/support/temp_folder.h"

#include <cmath>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <linux/input.h>
#include <sys/stat.h>
#include <unistd.h>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using Eigen::Vector3d;

struct Pad {  // what a FakePort has seen and shall say
  std::vector<GamepadEvent> events;
  std::size_t next = 0;  // event to read
  std::vector<double> rumbled;
  bool is_lost = false, rumbles = true;
  double now_s = 10;

  void press(std::uint16_t code, bool held) { events.push_back({EV_KEY, code, held ? 1 : 0}); }
  void move(std::uint16_t axis, int value) { events.push_back({EV_ABS, axis, value}); }
  void report() { events.push_back({EV_SYN, SYN_REPORT, 0}); }
};

class FakePort : public GamepadPort {
 public:
  explicit FakePort(Pad& pad) : pad_(pad) {}
  bool rumbles() const noexcept override { return pad_.rumbles; }
  Range range(std::uint16_t axis) const noexcept override {
    return axis == ABS_Z || axis == ABS_RZ ? Range{0, 255} : Range{-100, 100};
  }
  int read(std::span<GamepadEvent> events) noexcept override {
    if (pad_.is_lost) return -1;
    int count = 0;
    for (GamepadEvent& event : events) {
      if (pad_.next == pad_.events.size()) break;
      event = pad_.events[pad_.next++];
      ++count;
    }
    return count;
  }
  bool rumble(double strength) noexcept override {
    pad_.rumbled.push_back(strength);
    return true;
  }

 private:
  Pad& pad_;
};

GamepadOptions on(Pad& pad) {
  return {.full_speed_m_s = 0.1,
          .full_turn_rad_s = 2,
          .dead_zone = 0.2,
          .connect = [&pad](const std::string&) { return std::make_unique<FakePort>(pad); },
          .clock = [&pad] { return pad.now_s; }};
}

Wrench resisting(double part) {
  Wrench wrench;
  wrench.resistance = part;
  return wrench;
}

TEST(Gamepad, SticksAndTriggersAreRates) {
  Pad pad;
  Gamepad gamepad(on(pad));
  EXPECT_EQ(gamepad.exchange({}).status, DeviceStatus::closed);
  gamepad.open();
  EXPECT_TRUE(gamepad.capabilities().rate_control);
  EXPECT_EQ(gamepad.capabilities().peak_force_N, 0);
  DeviceState state = gamepad.exchange({});
  EXPECT_EQ(state.status, DeviceStatus::ready);
  EXPECT_TRUE(state.v_D.isZero(0) && state.twist_D.isZero(0)) << "before any event";
  pad.move(ABS_X, 60);
  pad.move(ABS_Y, -100);
  pad.move(ABS_Z, 0);
  pad.move(ABS_RZ, 255);
  pad.move(ABS_RX, 10);
  pad.move(ABS_RY, 100);
  pad.press(BTN_EAST, true);
  pad.report();
  pad.now_s = 10.5;
  state = gamepad.exchange({});
  EXPECT_NEAR(state.time_s, 0.5, 1e-12);
  EXPECT_NEAR((state.v_D - Vector3d(0.05, 0.1, -0.1)).norm(), 0, 1e-12) << state.v_D.transpose();
  EXPECT_NEAR((state.twist_D - Vector3d(2, 0, 0)).norm(), 0, 1e-12) << "10 of 100 is within the dead zone";
  EXPECT_EQ(state.buttons, 2U);
  EXPECT_EQ(*state.sent_N, Vector3d::Zero());
  state = gamepad.exchange({});
  EXPECT_NEAR(state.v_D.x(), 0.05, 1e-12) << "a stick that is held sends no events";
  pad.move(ABS_X, 1'000'000);
  pad.press(BTN_EAST, false);
  state = gamepad.exchange({});
  EXPECT_NEAR(state.v_D.x(), 0.1, 1e-12) << "never beyond full speed";
  EXPECT_EQ(state.buttons, 0U);
}

TEST(Gamepad, RestsAfterTheKernelLostEvents) {
  Pad pad;
  Gamepad gamepad(on(pad));
  gamepad.open();
  pad.move(ABS_X, 100);
  pad.press(BTN_SOUTH, true);
  pad.report();
  EXPECT_GT(gamepad.exchange({}).v_D.x(), 0);
  pad.events.push_back({EV_SYN, SYN_DROPPED, 0});
  pad.move(ABS_X, 100);
  DeviceState state = gamepad.exchange({});
  EXPECT_TRUE(state.v_D.isZero(0));
  EXPECT_EQ(state.buttons, 0U);
  pad.report();
  pad.move(ABS_X, -100);
  EXPECT_NEAR(gamepad.exchange({}).v_D.x(), -0.1, 1e-12);
}

TEST(Gamepad, RumblesWithTheResistanceAndNotTooOften) {
  Pad pad;
  Gamepad gamepad(on(pad));
  gamepad.open();
  for (int i = 0; i < 100; ++i, pad.now_s += 0.001) gamepad.exchange({});
  EXPECT_TRUE(pad.rumbled.empty());
  for (int i = 0; i < 1000; ++i, pad.now_s += 0.001) gamepad.exchange(resisting(0.5));
  EXPECT_GE(pad.rumbled.size(), 10U) << "an effect ends after 0.2 s";
  EXPECT_LE(pad.rumbled.size(), 20U);
  for (const double strength : pad.rumbled) EXPECT_EQ(strength, 0.5);
  gamepad.exchange({});
  EXPECT_EQ(pad.rumbled.back(), 0) << "at once";
  const std::size_t count = pad.rumbled.size();
  pad.now_s += 1;
  gamepad.exchange(resisting(NAN));
  gamepad.exchange(resisting(-1));
  EXPECT_EQ(pad.rumbled.size(), count) << "a resistance that is none";
  gamepad.exchange(resisting(1e300));
  EXPECT_EQ(pad.rumbled.back(), 1);
  gamepad.close();
  EXPECT_EQ(pad.rumbled.back(), 0);
}

TEST(Gamepad, IsLostWhenItIsUnplugged) {
  Pad pad;
  Gamepad gamepad(on(pad));
  gamepad.open();
  pad.move(ABS_X, 100);
  EXPECT_GT(gamepad.exchange({}).v_D.x(), 0);
  pad.is_lost = true;
  const DeviceState state = gamepad.exchange({});
  EXPECT_EQ(state.status, DeviceStatus::fault);
  EXPECT_TRUE(state.v_D.isZero(0));
  pad.is_lost = false;
  EXPECT_EQ(gamepad.exchange({}).status, DeviceStatus::fault);
  gamepad.open();
  EXPECT_EQ(gamepad.exchange({}).status, DeviceStatus::ready);
}

TEST(Gamepad, ExchangesWithoutAllocationOrLock) {
  Pad pad;
  pad.events.resize(200, {EV_ABS, ABS_X, 50});
  Gamepad gamepad(on(pad));
  gamepad.open();
  pad.rumbled.reserve(1000);
  test::NoAllocGuard guard;
  for (int i = 0; i < 300; ++i, pad.now_s += 0.01) gamepad.exchange(resisting(0.3));
  const test::ForbiddenCalls calls = guard.calls();
  EXPECT_EQ(calls.allocations + calls.locks, 0U) << calls.first;
}

// A named pipe gives the bytes of the kernel's events. It has neither ranges nor rumble.
TEST(Gamepad, ReadsTheKernelsEvents) {
  const test::TempFolder folder;
  const std::string path = folder / "event0";
  ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0);
  Gamepad gamepad({.path = path});
  gamepad.open();
  EXPECT_FALSE(gamepad.rumbles());
  EXPECT_EQ(gamepad.exchange(resisting(1)).status, DeviceStatus::ready) << "nothing waits";
  const int writer = ::open(path.c_str(), O_WRONLY | O_NONBLOCK);
  ASSERT_GE(writer, 0);
  input_event events[3] = {};
  events[0].type = EV_ABS;
  events[0].code = ABS_X;
  events[0].value = 32767;
  events[1].type = EV_KEY;
  events[1].code = BTN_SOUTH;
  events[1].value = 1;
  ASSERT_EQ(::write(writer, events, sizeof events), static_cast<ssize_t>(sizeof events));
  const DeviceState state = gamepad.exchange({});
  EXPECT_NEAR(state.v_D.x(), 0.05, 1e-9);
  EXPECT_EQ(state.buttons, 1U);
  ::close(writer);
  Gamepad none({.path = folder / "event1"});
  EXPECT_THROW(none.open(), DeviceError);
}

void putDevice(const test::TempFolder& folder, const std::string& node, const std::string& name, const std::string& key,
               const std::string& abs, const std::string& ff) {
  const std::string device = folder / ("sys/" + node + "/device");
  std::filesystem::create_directories(device + "/capabilities");
  test::writeBytes(device + "/name", name + "\n");
  test::writeBytes(device + "/capabilities/key", key + "\n");
  test::writeBytes(device + "/capabilities/abs", abs + "\n");
  test::writeBytes(device + "/capabilities/ff", ff + "\n");
  std::filesystem::create_directories(folder / "dev");
  test::writeBytes(folder / ("dev/" + node), "");
}

// Masks of an Xbox pad, a keyboard and a joystick without a gamepad's buttons, as kernels write them.
TEST(Gamepad, IsFoundByItsButtonsAndAxes) {
  const test::TempFolder folder;
  putDevice(folder, "event12", "Microsoft X-Box 360 pad", "7cdb000000000000 0 0 0 0", "3003f", "107030000 0");
  putDevice(folder, "event3", "AT Translated Set 2 keyboard",
            "402000000 3803078f800d001 feffffdfffefffff fffffffffffffffe", "0", "0");
  putDevice(folder, "event7", "a stick", "ffff00000000 0 0 0 0", "7", "0");
  putDevice(folder, "event5", "a pad without rumble", "7cdb000000000000 0 0 0 0", "3", "0");
  putDevice(folder, "js0", "the old interface", "7cdb000000000000 0 0 0 0", "3003f", "0");
  const std::vector<FoundGamepad> pads = findGamepads(folder / "sys", folder / "dev");
  ASSERT_EQ(pads.size(), 2U);
  EXPECT_EQ(pads[0].path, folder / "dev/event5");
  EXPECT_FALSE(pads[0].rumbles);
  EXPECT_EQ(pads[1].name, "Microsoft X-Box 360 pad");
  EXPECT_TRUE(pads[1].rumbles);
  EXPECT_TRUE(pads[1].may_open);
  std::filesystem::remove(folder / "dev/event12");
  EXPECT_FALSE(findGamepads(folder / "sys", folder / "dev")[1].may_open);
  EXPECT_TRUE(findGamepads(folder / "none", folder / "dev").empty());
}

}  // namespace
}  // namespace filiform
