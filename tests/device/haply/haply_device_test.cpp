// The driver on a simulated service in virtual time. haply_socket_test.cpp has the same by TCP.
#include "device/haply/haply_device.h"

#include "device/haply/simulated_haply.h"

#include <cmath>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <utility>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using Eigen::Vector3d;

Wrench forceOf(const Vector3d& force_N) {
  Wrench wrench;
  wrench.force_N = force_N;
  return wrench;
}

struct HaplyBench {
  explicit HaplyBench(SimulatedHaplyOptions what = {}, HaplyOptions options = {})
      : service(what), haply(connected(std::move(options))) {}
  HaplyOptions connected(HaplyOptions options) {
    options.connect = service.connections();
    return options;
  }
  DeviceState repeat(int times, const Wrench& wrench = {}) {
    DeviceState state;
    for (int i = 0; i < times; ++i) state = haply.exchange(wrench);
    return state;
  }
  // Until the ramp has ended: half a second of 0.5 ms.
  DeviceState settle(const Wrench& wrench = {}) { return repeat(1200, wrench); }
  // Exchanges until the driver has this status; fails after two seconds of the driver's time.
  DeviceState until(DeviceStatus status, const Wrench& wrench = {}) {
    DeviceState state = haply.exchange(wrench);
    for (int i = 0; i < 4000 && state.status != status; ++i) state = haply.exchange(wrench);
    EXPECT_EQ(state.status, status);
    return state;
  }

  SimulatedHaply service;
  HaplyDevice haply;
};

std::string whyNot(HaplyDevice& haply) {
  try {
    haply.open();
  } catch (const DeviceError& error) {
    return error.what();
  }
  return "";
}

TEST(HaplyDevice, ProvesItsForceAndIsReadyInEitherDialect) {
  for (const char* version : {"3.5.2", "3.1.0"}) {
    HaplyBench bench({.version = version});
    bench.haply.open();
    EXPECT_EQ(bench.haply.status(), DeviceStatus::ready);
    EXPECT_STREQ(bench.haply.advice(), "");
    EXPECT_STREQ(bench.haply.transport().dialect, version[2] == '5' ? "vector" : "values");
    EXPECT_NEAR(bench.service.strongest_N(), HaplyDevice::kProbe_N, 1e-12);
    EXPECT_EQ(bench.haply.capabilities().name, "Haply Inverse3 049D");
    EXPECT_TRUE(bench.haply.capabilities().paces_loop);
  }
}

// A service that states a version, but takes the other name.
TEST(HaplyDevice, TriesTheOtherNameOfAForceThatHasNoEffect) {
  class Misleading : public ByteStream {
   public:
    explicit Misleading(std::unique_ptr<ByteStream> inner) : inner_(std::move(inner)) {}
    bool write(std::span<const char> bytes, double wait_s) noexcept override { return inner_->write(bytes, wait_s); }
    long read(std::span<char> into, double wait_s) noexcept override {
      const long got = inner_->read(into, wait_s);
      if (got <= 0) return got;
      const std::string_view text(into.data(), static_cast<std::size_t>(got));
      if (const std::size_t at = text.find("\"3.5.2\""); at != std::string_view::npos) into[at + 3] = '1';
      return got;
    }
    void sleepUntil(double until_s) noexcept override { inner_->sleepUntil(until_s); }
    double time_s() const noexcept override { return inner_->time_s(); }

   private:
    std::unique_ptr<ByteStream> inner_;
  };
  SimulatedHaply service;
  HaplyOptions options;
  options.connect = [make = service.connections()] { return std::make_unique<Misleading>(make()); };
  HaplyDevice haply(options);
  haply.open();
  EXPECT_EQ(haply.status(), DeviceStatus::ready);
  EXPECT_NE(haply.transport().version.find("3.1"), std::string::npos);
  EXPECT_STREQ(haply.transport().dialect, "vector");
}

TEST(HaplyDevice, RefusesADeviceThatIgnoresItsForce) {
  HaplyBench bench;
  bench.service.faults().ignores_force = true;
  const std::string why = whyNot(bench.haply);
  EXPECT_NE(why.find("does not report the force"), std::string::npos) << why;
  EXPECT_EQ(bench.haply.status(), DeviceStatus::closed);
}

TEST(HaplyDevice, TurnsTheFrames) {
  HaplyBench bench;
  bench.haply.open();
  // D: x right, y up, z towards the person. H: x right, y away from the person, z up.
  const std::pair<Vector3d, Vector3d> cases[] = {
      {{1, 0, 0}, {1, 0, 0}}, {{0, 1, 0}, {0, 0, 1}}, {{0, 0, 1}, {0, -1, 0}}};
  for (const auto& [force_D, force_H] : cases) {
    const DeviceState state = bench.settle(forceOf(force_D));
    EXPECT_LT((bench.service.force_H() - force_H).norm(), 1e-12);
    EXPECT_LT((*state.sent_N - force_D).norm(), 1e-12);
    EXPECT_GT(state.p_D.dot(force_D), 0.001);
    EXPECT_LT((state.p_D - state.p_D.dot(force_D) * force_D).norm(), 1e-3);
  }
}

TEST(HaplyDevice, LimitsTheForceAndKeepsItsDirection) {
  HaplyBench bench;
  bench.haply.open();
  DeviceState state = bench.settle(forceOf({30, 0, 40}));
  EXPECT_NEAR(state.sent_N->norm(), HaplyDevice::kMostForce_N, 1e-12);
  EXPECT_NEAR(state.sent_N->z() / state.sent_N->x(), 4.0 / 3, 1e-12);
  for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity()}) {
    state = bench.repeat(1, forceOf({0, bad, 0}));
    EXPECT_EQ(*state.sent_N, Vector3d::Zero());
    EXPECT_EQ(bench.service.force_H(), Vector3d::Zero());
  }
  EXPECT_LE(bench.service.strongest_N(), HaplyDevice::kMostForce_N + 1e-12);
}

TEST(HaplyDevice, ForceGrowsFromZeroAfterTheProof) {
  HaplyBench bench;
  bench.haply.open();
  double last_N = 0;
  for (int i = 0; i < 1200; ++i) {
    const DeviceState state = bench.repeat(1, forceOf({1, 0, 0}));
    EXPECT_LE(state.sent_N->x(), last_N + 0.0021 + 1e-12);
    last_N = state.sent_N->x();
  }
  EXPECT_EQ(last_N, 1);
}

TEST(HaplyDevice, WaitsForCalibrationAndSaysSo) {
  HaplyBench bench;
  bench.service.faults().calibrated = false;
  bench.haply.open();
  EXPECT_EQ(bench.repeat(100, forceOf({1, 0, 0})).status, DeviceStatus::homing);
  EXPECT_NE(std::string(bench.haply.advice()).find("not calibrated"), std::string::npos);
  EXPECT_EQ(bench.service.strongest_N(), 0);
  bench.service.faults().calibrated = true;
  bench.service.faults().ready = false;
  bench.repeat(10);
  EXPECT_NE(std::string(bench.haply.advice()).find("not ready"), std::string::npos);
  bench.service.faults().ready = true;
  bench.until(DeviceStatus::ready);
  EXPECT_STREQ(bench.haply.advice(), "");
}

TEST(HaplyDevice, ForceEndsWhenTheDeviceIsNoLongerReady) {
  HaplyBench bench;
  bench.haply.open();
  bench.settle(forceOf({1, 0, 0}));
  bench.service.faults().power = false;
  const DeviceState state = bench.until(DeviceStatus::homing, forceOf({1, 0, 0}));
  EXPECT_EQ(*state.sent_N, Vector3d::Zero());
  EXPECT_NE(std::string(bench.haply.advice()).find("no power"), std::string::npos);
  bench.service.faults().power = true;
  EXPECT_LT(bench.until(DeviceStatus::ready, forceOf({1, 0, 0})).sent_N->norm(), 0.01);
}

TEST(HaplyDevice, ForceIsProvenAgainWhenTheStatesNoLongerReportIt) {
  HaplyBench bench;
  bench.haply.open();
  bench.settle(forceOf({1, 0, 0}));
  bench.service.faults().ignores_force = true;
  DeviceState state = bench.until(DeviceStatus::homing, forceOf({1, 0, 0}));
  EXPECT_EQ(*state.sent_N, Vector3d::Zero());
  bench.service.faults().ignores_force = false;
  bench.until(DeviceStatus::ready, forceOf({1, 0, 0}));
  bench.service.faults().ignores_force = true;
  state = bench.until(DeviceStatus::fault, forceOf({1, 0, 0}));
  EXPECT_NE(std::string(bench.haply.advice()).find("does not report"), std::string::npos);
}

TEST(HaplyDevice, ForceIsZeroAfterADisconnect) {
  HaplyBench bench;
  bench.haply.open();
  bench.settle(forceOf({1, 0, 0}));
  bench.service.faults().ends = true;
  const DeviceState state = bench.until(DeviceStatus::fault, forceOf({1, 0, 0}));
  EXPECT_EQ(state.v_D, Vector3d::Zero());
  EXPECT_NE(std::string(bench.haply.advice()).find("ended the connection"), std::string::npos);
  bench.haply.close();
  EXPECT_EQ(bench.service.force_H(), Vector3d::Zero());
  bench.service.faults().ends = false;
  bench.haply.open();
  EXPECT_EQ(bench.haply.status(), DeviceStatus::ready);
}

// Ends when it has carried so many more messages.
struct EndingStream : ByteStream {
  EndingStream(std::unique_ptr<ByteStream> of, int& allowed) : stream(std::move(of)), left(allowed) {}
  bool write(std::span<const char> bytes, double wait_s) noexcept override {
    return left-- > 0 && stream->write(bytes, wait_s);
  }
  long read(std::span<char> into, double wait_s) noexcept override { return stream->read(into, wait_s); }
  void sleepUntil(double until_s) noexcept override { stream->sleepUntil(until_s); }
  double time_s() const noexcept override { return stream->time_s(); }

  std::unique_ptr<ByteStream> stream;
  int& left;
};

TEST(HaplyDevice, AConnectionThatEndsAtTheZeroMessagesIsAFault) {
  SimulatedHaply service;
  int messages = 1 << 20;
  HaplyOptions options;
  options.connect = [&] { return std::make_unique<EndingStream>(service.connections()(), messages); };
  HaplyDevice haply(options);
  haply.open();
  for (int i = 0; i < 1200; ++i) haply.exchange(forceOf({1, 0, 0}));
  service.faults().power = false;
  messages = 1;
  const DeviceState state = haply.exchange(forceOf({1, 0, 0}));
  EXPECT_GT(state.sent_N->norm(), 0.9);  // the last force that was sent
  EXPECT_EQ(state.status, DeviceStatus::fault);
  EXPECT_NE(std::string(haply.advice()).find("ended the connection"), std::string::npos);
}

TEST(HaplyDevice, AStallIsSentZeroThenIsAFault) {
  HaplyBench bench;
  bench.haply.open();
  DeviceState before = bench.settle(forceOf({1, 0, 0}));
  bench.service.faults().is_silent = true;
  // Two exchanges of 5 ms without an answer; the third finds that the state is stale.
  DeviceState state = bench.repeat(2, forceOf({1, 0, 0}));
  EXPECT_EQ(state.time_s, before.time_s);
  EXPECT_EQ(state.status, DeviceStatus::ready);
  state = bench.repeat(2, forceOf({1, 0, 0}));
  EXPECT_EQ(bench.service.force_H(), Vector3d::Zero());
  EXPECT_EQ(*state.sent_N, Vector3d::Zero());
  bench.until(DeviceStatus::fault, forceOf({1, 0, 0}));
  EXPECT_NE(std::string(bench.haply.advice()).find("does not answer"), std::string::npos);
  EXPECT_EQ(bench.service.force_H(), Vector3d::Zero());
}

TEST(HaplyDevice, AfterAShortStallTheForceGrowsFromZero) {
  HaplyBench bench;
  bench.haply.open();
  bench.settle(forceOf({1, 0, 0}));
  bench.service.faults().holds = true;
  bench.repeat(8, forceOf({1, 0, 0}));
  bench.service.faults().holds = false;
  double last_N = 0;
  for (int i = 0; i < 20; ++i) {
    const DeviceState state = bench.repeat(1, forceOf({1, 0, 0}));
    EXPECT_EQ(state.status, DeviceStatus::ready);
    EXPECT_LE(state.sent_N->x(), last_N + 0.05) << i;
    last_N = state.sent_N->x();
  }
  EXPECT_GT(last_N, 0);
  EXPECT_LT(last_N, 0.2);
  // Each message has its answer again: the state is that of the newest message.
  const std::uint64_t answers = bench.service.answers();
  bench.repeat(10);
  EXPECT_EQ(bench.service.answers(), answers + 10);
}

TEST(HaplyDevice, AJumpOfThePositionTakesTheForceAway) {
  HaplyBench bench;
  bench.haply.open();
  bench.settle(forceOf({1, 0, 0}));
  bench.service.faults().jump_m = 0.05;
  bench.repeat(1, forceOf({1, 0, 0}));
  EXPECT_EQ(bench.haply.counters().jumps, 1U);
  EXPECT_LT(bench.repeat(1, forceOf({1, 0, 0})).sent_N->x(), 0.01);
  bench.service.faults().jump_m = 5;  // beyond its reach: the time stands still
  const double last_s = bench.repeat(1).time_s;
  EXPECT_EQ(bench.repeat(3).time_s, last_s);
}

TEST(HaplyDevice, ReadsStatesThatLeaveOutWhatIsZero) {
  HaplyBench bench;
  bench.service.faults().leaves_out = true;
  bench.haply.open();
  EXPECT_EQ(bench.haply.status(), DeviceStatus::ready);
  const DeviceState state = bench.settle(forceOf({0, 0, 1}));
  EXPECT_NEAR(bench.service.force_H().y(), -1, 1e-12);
  EXPECT_EQ(state.p_D.x(), 0);
}

TEST(HaplyDevice, ForceIsZeroWhilePositionsAreMissingOrGarbage) {
  for (const bool garbage : {false, true}) {
    HaplyBench bench;
    bench.haply.open();
    bench.settle(forceOf({1, 0, 0}));
    (garbage ? bench.service.faults().sends_garbage : bench.service.faults().has_no_position) = true;
    const double last_s = bench.repeat(1, forceOf({1, 0, 0})).time_s;
    const DeviceState state = bench.repeat(40, forceOf({1, 0, 0}));
    EXPECT_EQ(state.time_s, last_s);
    EXPECT_EQ(*state.sent_N, Vector3d::Zero());
    EXPECT_EQ(bench.service.force_H(), Vector3d::Zero());
    EXPECT_EQ(bench.haply.counters().unreadable > 30, garbage);
  }
}

TEST(HaplyDevice, StatesThatAreSentTwiceDoNotMakeItLate) {
  HaplyBench bench;
  bench.service.faults().sends_twice = true;
  bench.haply.open();
  ASSERT_EQ(bench.haply.status(), DeviceStatus::ready);
  bench.settle();
  for (int i = 0; i < 100; ++i) {
    bench.service.faults().jump_m = 1e-5 * i;
    EXPECT_NEAR(bench.repeat(1).p_D.x(), 1e-5 * i, 1e-9);
  }
}

TEST(HaplyDevice, ReportsTheGripsButtons) {
  HaplyBench bench;
  bench.haply.open();
  bench.service.faults().buttons = 5;
  EXPECT_EQ(bench.repeat(1).buttons, 5U);
  bench.service.faults().buttons = 0;
  EXPECT_EQ(bench.repeat(1).buttons, 0U);
}

TEST(HaplyDevice, ChoosesAmongDevicesByTheirId) {
  SimulatedHaplyOptions two;
  two.devices = {"049D", "04A0"};
  HaplyBench unnamed(two);
  const std::string why = whyNot(unnamed.haply);
  EXPECT_NE(why.find("several Inverse3 are connected (049D, 04A0)"), std::string::npos) << why;
  HaplyBench wrong(two, {.id = "0000"});
  EXPECT_NE(whyNot(wrong.haply).find("no Inverse3 with the id 0000"), std::string::npos);
  HaplyBench none({.devices = {}});
  EXPECT_NE(whyNot(none.haply).find("no Inverse3 is connected"), std::string::npos);
  HaplyBench second(two, {.id = "04A0"});
  second.haply.open();
  second.settle(forceOf({1, 0, 0}));
  EXPECT_EQ(second.service.force_H(0), Vector3d::Zero());
  EXPECT_NEAR(second.service.force_H(1).x(), 1, 1e-12);
}

TEST(HaplyDevice, CloseLeavesNoForceFromAnyState) {
  for (const int exchanges : {0, 1, 5, 50, 1200}) {
    HaplyBench bench;
    bench.haply.open();
    bench.repeat(exchanges, forceOf({1, 0, 0}));
    bench.haply.close();
    EXPECT_EQ(bench.service.force_H(), Vector3d::Zero());
    EXPECT_EQ(bench.haply.status(), DeviceStatus::closed);
    bench.haply.close();
  }
  HaplyDevice never;
  never.close();
  EXPECT_EQ(never.exchange({}).status, DeviceStatus::closed);
}

TEST(HaplyDevice, MeasuresItsTransportAndTheStiffnessThatFollows) {
  for (const double period_s : {0.0005, 0.001, 0.004})
    for (const int delay : {0, 2}) {
      HaplyBench bench({.period_s = period_s, .command_delay = delay});
      bench.haply.open();
      const HaplyTransport& transport = bench.haply.transport();
      EXPECT_NEAR(transport.period_s, period_s, 1e-9);
      EXPECT_EQ(transport.delay_states, delay);
      EXPECT_EQ(bench.haply.capabilities().delay_samples, 1 + delay);
      EXPECT_NEAR(bench.haply.capabilities().nominal_rate_Hz, 1 / period_s, 1e-3);
      const double bound_N_m = 0.5 / (period_s * (1.5 + delay));
      EXPECT_NEAR(bench.haply.capabilities().max_stiffness_N_m, std::min(500.0, bound_N_m), 1e-3);
    }
}

TEST(HaplyDevice, RefusesAServiceThatIsTooSlowForForce) {
  HaplyBench bench({.period_s = 0.02});
  const std::string why = whyNot(bench.haply);
  EXPECT_NE(why.find("too slowly"), std::string::npos) << why;
  EXPECT_NE(why.find("50 times a second"), std::string::npos) << why;
  EXPECT_EQ(bench.service.force_H(), Vector3d::Zero());
}

TEST(HaplyDevice, OptionsAreReadFromItsName) {
  EXPECT_EQ(haplyOptions("").port, 10001);
  EXPECT_EQ(haplyOptions(",049D").id, "049D");
  const HaplyOptions all = haplyOptions(":lab-7:1234,04A0");
  EXPECT_EQ(all.host, "lab-7");
  EXPECT_EQ(all.port, 1234);
  EXPECT_EQ(all.id, "04A0");
  EXPECT_EQ(haplyOptions(":[::1]:99").host, "::1");
  for (const char* bad : {":", ":host", ":host:", ":host:0", ":host:65536", ":host:1x", "::1", ",", ",a,b", ",\"", "x"})
    EXPECT_THROW(haplyOptions(bad), UnknownDevice) << bad;
}

TEST(HaplyDevice, ReportsTheOrientationOfTheGripInFrameD) {
  HaplyBench bench;
  bench.haply.open();
  EXPECT_TRUE(bench.haply.capabilities().senses_orientation);
  EXPECT_EQ(bench.until(DeviceStatus::ready).orientation_D.coeffs(), Eigen::Vector4d(0, 0, 0, 1));
  // A turn about the service's z axis, upwards, is one about y in frame D; about its y axis, away, one about -z.
  bench.service.setOrientation({0.8, 0, 0, 0.6});
  EXPECT_LT((bench.repeat(1).orientation_D.coeffs() - Eigen::Vector4d(0, 0.6, 0, 0.8)).norm(), 1e-12);
  bench.service.setOrientation({0.8, 0, 0.6, 0});
  EXPECT_LT((bench.repeat(1).orientation_D.coeffs() - Eigen::Vector4d(0, 0, -0.6, 0.8)).norm(), 1e-12);
  HaplyBench without({.has_grip = false});
  without.haply.open();
  EXPECT_FALSE(without.haply.capabilities().senses_orientation);
}

TEST(HaplyDevice, LeadsTheHandOfASimulatedServiceOnly) {
  for (const bool is_led : {true, false}) {
    HaplyBench bench({.is_led = is_led});
    bench.haply.open();
    EXPECT_EQ(bench.haply.capabilities().is_led, is_led);
    bench.until(DeviceStatus::ready);
    bench.haply.lead({0.01, 0.02, -0.015});
    const Vector3d p_D = bench.settle().p_D;
    EXPECT_LT((p_D - (is_led ? Vector3d(0.01, 0.02, -0.015) : Vector3d::Zero())).norm(), 1e-4) << p_D.transpose();
    bench.haply.lead({NAN, 0, 0});
    EXPECT_LT((bench.settle().p_D - p_D).norm(), 1e-4);
  }
}

TEST(HaplyDevice, TheSimulatedHandCanMoveByAClock) {
  double now_s = 0;
  SimulatedHaply service({.is_led = true, .clock = [&now_s] { return now_s; }});
  const std::string message =
      R"({"inverse3":[{"device_id":"049D","commands":{"filiform_aim":{"position":{"x":0.01,"y":-0.12,"z":0.15}}}}]})";
  const auto x_m = [&] {
    const std::string answer = service.answer(message);
    const std::size_t at = answer.find("\"cursor_position\":{\"x\":");
    return std::stod(answer.substr(at + 23));
  };
  x_m();
  const double first_m = x_m();
  EXPECT_EQ(x_m(), first_m) << "no time has passed";
  now_s = 0.05;
  EXPECT_GT(x_m(), first_m + 0.001) << "all periods of 50 ms";
  now_s = 2;
  for (int i = 0; i < 30; ++i, now_s += 0.1) x_m();
  EXPECT_NEAR(x_m(), 0.01, 1e-4);
}

}  // namespace
}  // namespace filiform
