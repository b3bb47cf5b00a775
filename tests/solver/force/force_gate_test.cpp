#include "solver/force/force_gate.h"

#include "index/errors.h"
#include "tests/support/no_alloc_guard.h"
#include "tests/support/numbers.h"

#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using Eigen::Vector3d;
using test::kDt_s;
using test::kInfinity;
using test::kNaN;
using test::logUniform;

ForceGate::Input wanting(const Vector3d& force_N, double dt_s = kDt_s) {
  ForceGate::Input input;
  input.wanted.force_N = force_N;
  input.wanted.torque_Nm = 0.1 * force_N;
  input.dt_s = dt_s;
  return input;
}

double sentBy(ForceGate& gate, double force_N) { return gate.pass(wanting({force_N, 0, 0})).force_N.x(); }

TEST(ForceGate, OpensOverTheRampOrAtOnce) {
  ForceGate ramped({.ramp_s = 0.1}), open({.ramp_s = 0.1}, true);
  for (int tick = 0; tick <= 150; ++tick) {
    EXPECT_NEAR(sentBy(ramped, 2), 2 * std::min(1.0, tick / 100.0), 1e-12);
    EXPECT_EQ(sentBy(open, 2), 2);
  }
}

TEST(ForceGate, NothingPassesAStaleStateOrWhileForceIsWithheldOrTheDeviceIsNotReady) {
  for (int why = 0; why < 4; ++why) {
    ForceGate gate({.ramp_s = 0.1}, true);
    ASSERT_EQ(sentBy(gate, 2), 2);
    ForceGate::Input input = wanting({2, 0, 0});
    if (why == 0) input.stale = true;
    if (why == 1) input.withheld = true;
    if (why == 2) input.ready = false;
    if (why == 3) input.wanted.torque_Nm.y() = kNaN;
    const Wrench sent = gate.pass(input);
    EXPECT_TRUE(sent.force_N.isZero(0));
    EXPECT_TRUE(sent.torque_Nm.isZero(0));
    // For a state that is not ready, the tick has its own ramp. The other cases restart the gate's ramp.
    EXPECT_EQ(sentBy(gate, 2), why < 2 ? 0 : 2) << why;
    if (why < 2) {
      EXPECT_NEAR(sentBy(gate, 2), 2 * 0.01, 1e-12);
    }
  }
}

TEST(ForceGate, FadesAndThenOpensOverTheRamp) {
  ForceGate gate({.ramp_s = 0.1, .fade_s = 0.05}, true);
  ASSERT_EQ(sentBy(gate, 2), 2);
  gate.restart();
  for (int tick = 1; tick < 50; ++tick) {
    ASSERT_TRUE(gate.fading());
    EXPECT_NEAR(gate.faded_N(kDt_s).x(), 2 * (1 - tick / 50.0), 1e-9);
    EXPECT_NEAR(sentBy(gate, 5), 2 * (1 - tick / 50.0), 1e-9) << "at most the rest of the old force";
  }
  sentBy(gate, 5);
  for (int tick = 0; tick <= 100; ++tick) EXPECT_NEAR(sentBy(gate, 5), 0.05 * tick, 0.051);
  EXPECT_FALSE(gate.fading());
}

TEST(ForceGate, AStrongForceTakesLongerToFadeAndNoneDoesNotFade) {
  ForceGate gate({.ramp_s = 0.1, .fade_s = 0.05, .max_fade_N_s = 100}, true);
  ASSERT_EQ(sentBy(gate, 8), 8);
  gate.restart();
  double last_N = 8;
  for (int tick = 1; tick < 80; ++tick) {
    const double sent_N = sentBy(gate, 8);
    EXPECT_NEAR(last_N - sent_N, 0.1, 1e-9);
    last_N = sent_N;
  }
  gate.close();
  gate.restart();
  EXPECT_FALSE(gate.fading());
}

// Any inputs in any order: the force is finite, within the clamp, and never grows faster than the limits allow.
TEST(ForceGate, BoundsHoldForAnyInput) {
  constexpr std::uint64_t kSeed = 5;
  SCOPED_TRACE(kSeed);
  std::mt19937_64 random(kSeed);
  std::uint64_t fades = 0;
  for (int round = 0; round < 300; ++round) {
    ForceGateOptions options;
    options.max_force_N = logUniform(random, 1e-2, 50);
    options.max_slew_N_s = logUniform(random, 1, 1e4);
    options.ramp_s = random() % 3 ? logUniform(random, 1e-3, 2) : 0.0;
    options.fade_s = random() % 3 ? logUniform(random, 1e-3, 0.2) : 0.0;
    ForceGate gate(options, random() % 2 == 0);
    test::NoAllocGuard guard;
    double last_N = 0;
    for (int tick = 0; tick < 300; ++tick) {
      const auto number = [&] {
        const double size = logUniform(random, 1e-9, random() % 10 == 0 ? 1e300 : 10.0);
        return random() % 60 == 0 ? kNaN : random() % 60 == 0 ? kInfinity : random() % 2 ? size : -size;
      };
      ForceGate::Input input = wanting({number(), number(), number()}, logUniform(random, 1e-6, 0.1));
      if (random() % 30 == 0) input.dt_s = random() % 2 ? kNaN : -1.0;
      input.free_N = random() % 2 ? 0.0 : logUniform(random, 1e-3, 1);
      input.stale = random() % 40 == 0;
      input.withheld = random() % 40 == 0;
      input.ready = random() % 40 != 0;
      if (random() % 25 == 0) gate.restart();
      if (random() % 60 == 0) gate.close();
      if (gate.sent().force_N.isZero(0)) last_N = 0;
      const bool fading = gate.fading();
      fades += fading;
      const Vector3d sent_N = gate.pass(input).force_N;
      ASSERT_TRUE(sent_N.allFinite());
      ASSERT_LE(sent_N.norm(), options.max_force_N * (1 + 1e-12));
      const double dt_s = input.dt_s > 0 && std::isfinite(input.dt_s) ? input.dt_s : 0.0;
      const double ramp_N_s = options.ramp_s > 0 ? options.max_force_N / options.ramp_s : 0.0;
      ASSERT_LE(sent_N.norm(), last_N + (options.max_slew_N_s + ramp_N_s) * dt_s + input.free_N + 1e-9);
      if (fading && gate.fading()) {
        ASSERT_LE(sent_N.norm(), last_N * (1 + 1e-9));
      }
      if (input.stale || input.withheld || !input.ready || !input.wanted.force_N.allFinite()) {
        ASSERT_TRUE(sent_N.isZero(0));
      }
      last_N = sent_N.norm();
    }
    EXPECT_EQ(guard.calls().total(), 0u);
  }
  EXPECT_GT(fades, 1000u);
}

TEST(ForceGate, RefusesOptionsOutOfRange) {
  for (double ForceGateOptions::*option :
       {&ForceGateOptions::max_force_N, &ForceGateOptions::max_slew_N_s, &ForceGateOptions::ramp_s,
        &ForceGateOptions::fade_s, &ForceGateOptions::max_fade_N_s}) {
    for (const double bad : {kNaN, -1.0}) {
      ForceGateOptions options;
      options.*option = bad;
      EXPECT_THROW(ForceGate{options}, UsageError);
    }
  }
}

}  // namespace
}  // namespace filiform
