#include "solver/loop/loop_gate.h"

#include "index/errors.h"
#include "solver/loop/haptic_loop.h"
#include "tests/support/folders.h"
#include "tests/support/numbers.h"
#include "tests/support/temp_folder.h"

#include <cmath>
#include <string>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::kInfinity;
using test::kNaN;

Wrench pushOf(double force_N) {
  Wrench wrench;
  wrench.force_N.x() = force_N;
  return wrench;
}

DeviceState sampleAt(double time_s, DeviceStatus status = DeviceStatus::ready) {
  DeviceState state;
  state.time_s = time_s;
  state.status = status;
  return state;
}

// A loop that sends 2 N once a millisecond.
struct Pushing {
  explicit Pushing(const LoopGateOptions& options = {.ramp_at_start = false}) : gate(options) {}
  double tick(bool withheld = false, bool still = false) {
    now_s += 0.001;
    if (!still) device_s += 0.001;
    DeviceState state = sampleAt(device_s);
    step_s = gate.take(state, now_s);
    gate.put(pushOf(2), withheld);
    return gate.wrench().force_N.x();
  }
  LoopGate gate;
  double now_s = 0, device_s = 0, step_s = 0;
};

TEST(LoopGate, FillsInTheSentForceIfTheDeviceDoesNot) {
  Pushing loop;
  loop.tick();
  DeviceState state = sampleAt(1);
  loop.gate.take(state, 1);
  ASSERT_TRUE(state.sent_N.has_value());
  EXPECT_EQ(state.sent_N->x(), 2);
  state.sent_N = Eigen::Vector3d(1, 0, 0);
  loop.gate.take(state, 1.001);
  EXPECT_EQ(state.sent_N->x(), 1);
}

TEST(LoopGate, AStillClockTakesTheForceAfter15ms) {
  EXPECT_EQ(HapticLoopOptions{}.watchdog_s, 0.015);
  EXPECT_EQ(LoopGateOptions{}.watchdog_s, HapticLoopOptions{}.watchdog_s);
  const std::string page = test::readBytes(test::inSource("solver/FORCES.md"));
  EXPECT_NE(page.find("clock stands still for 0.015 s"), std::string::npos);
  Pushing loop;
  loop.tick();
  for (int ms = 1; ms <= 14; ++ms) EXPECT_EQ(loop.tick(false, true), 2) << ms;
  loop.tick(false, true);  // 15 ms; rounding decides the result
  for (int ms = 16; ms <= 30; ++ms) {
    EXPECT_EQ(loop.tick(false, true), 0) << ms;
    EXPECT_TRUE(loop.gate.stale());
  }
  EXPECT_EQ(loop.tick(), 0);  // the clock moves again: the ramp begins
  EXPECT_NEAR(loop.tick(), 2 * 0.001 / 0.5, 1e-9);
}

TEST(LoopGate, AnInterruptionAndWithheldForceBeginTheRampAnew) {
  Pushing loop;
  EXPECT_EQ(loop.tick(), 2);
  loop.gate.interrupt();
  EXPECT_EQ(loop.gate.wrench().force_N.x(), 0);
  EXPECT_EQ(loop.tick(), 0);
  for (int ms = 1; ms < 500; ++ms) EXPECT_NEAR(loop.tick(), 2 * ms / 500.0, 1e-9);
  EXPECT_EQ(loop.tick(true), 0);
  EXPECT_EQ(loop.tick(), 0);
  EXPECT_NEAR(loop.tick(), 2 / 500.0, 1e-9);
}

TEST(LoopGate, AtTheEndTheForceFadesWithoutAStepBeyondTheSlewLimit) {
  Pushing loop;
  EXPECT_EQ(loop.tick(), 2);
  loop.gate.end();
  double last_N = 2;
  int ticks = 0;
  for (; !loop.gate.ended(); ++ticks) {
    const double now_N = loop.tick();
    EXPECT_LE(std::abs(now_N - last_N), 100 * 0.001 + 1e-9);
    last_N = now_N;
    ASSERT_LT(ticks, 200);
  }
  EXPECT_LT(last_N, 0.1);
  EXPECT_NEAR(ticks, 50, 1);
  // Without a force, the fade is over at once.
  LoopGate idle({.ramp_at_start = false});
  idle.end();
  EXPECT_TRUE(idle.ended());
}

TEST(LoopGate, RefusesTimesThatAreNegativeOrNotFinite) {
  for (double LoopGateOptions::*option :
       {&LoopGateOptions::period_s, &LoopGateOptions::watchdog_s, &LoopGateOptions::ramp_s, &LoopGateOptions::fade_s}) {
    for (const double bad : {kNaN, kInfinity, -1.0}) {
      LoopGateOptions options;
      options.*option = bad;
      EXPECT_THROW(LoopGate{options}, UsageError);
    }
  }
}

TEST(TickClock, MeasuresStepsAndBoundsHiccups) {
  TickClock clock(0.001);
  EXPECT_EQ(clock.step_s(5), 0.001) << "the first state";
  EXPECT_NEAR(clock.step_s(5.002), 0.002, 1e-12) << "a device at 500 Hz";
  EXPECT_EQ(clock.step_s(5.003), 0.001) << "not 0.00099999999999";
  EXPECT_EQ(clock.step_s(6), clock.mostStep_s());
  EXPECT_EQ(clock.mostStep_s(), 0.010);
  EXPECT_EQ(TickClock(0.02).mostStep_s(), 0.04);
  for (const double bad : {kNaN, kInfinity, 1.0}) EXPECT_EQ(clock.step_s(bad), 0.001) << "not finite, or backwards";
}

TEST(TickClock, ADeviceThatIsSlowerThanTheLoopDoesNotMakeTimeRunFaster) {
  TickClock clock(0.001);
  clock.step_s(0);
  double sum_s = 0;
  for (int ms = 1; ms <= 1000; ++ms) sum_s += clock.step_s(0.008 * (ms / 8));
  EXPECT_NEAR(sum_s, 1, 0.01);
}

}  // namespace
}  // namespace filiform
