#include "solver/force/spring_model.h"

#include "solver/force/force_gate.h"
#include "solver/force/force_law.h"
#include "tests/support/no_alloc_guard.h"
#include "tools/bridges/bridge_force.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

TEST(SpringModel, HoldsTheHandAcrossTheNeuriteAndLetsItSlideAlong) {
  SpringModel spring;
  const Vector3d along_D = Vector3d(1, 2, 2) / 3;
  const LocalModel model = spring.about({0.01, 0, 0}, {0, 0.005, 0}, {0, 1, 0}, 200, along_D);
  EXPECT_TRUE(isSpring(model));
  EXPECT_EQ(model.at_D, Vector3d(0.01, 0, 0));
  EXPECT_NEAR((model.stiffness_N_m * along_D).norm(), 0, 1e-12);
  const Vector3d across_D = Vector3d(0, 1, -1).normalized();
  EXPECT_NEAR((model.stiffness_N_m * across_D - 200 * across_D).norm(), 0, 1e-12);
  EXPECT_EQ(model.radius_m, kModelRadius_m);
  EXPECT_EQ(spring.about({0, 0, 0}, {0, 0.005, 0}, {0, 1, 0}, 200, Vector3d::Zero()).stiffness_N_m,
            200 * Matrix3d::Identity())
      << "at a node";
}

TEST(SpringModel, IsLessStiffAsTheForceIsShortened) {
  SpringModel spring;
  const Vector3d none = Vector3d::Zero();
  EXPECT_NEAR(spring.about(none, {0, 0.005, 0}, {0, 0.25, 0}, 200, none).stiffness_N_m(1, 1), 50, 1e-12);
  EXPECT_NEAR(spring.about(none, {0, 1e-9, 0}, none, 200, none).stiffness_N_m(1, 1), 50, 1e-12) << "as before";
  EXPECT_EQ(spring.about(none, {0, 0.005, 0}, {0, 5, 0}, 200, none).stiffness_N_m(1, 1), 200) << "never more";
  spring.reset();
  EXPECT_TRUE(spring.about(none, none, none, 200, none).stiffness_N_m.isZero(0));
}

TEST(SpringModel, TheGateScalesItAsTheForce) {
  SpringModel spring;
  Wrench wanted;
  wanted.force_N = {0, 4, 0};
  wanted.model = spring.about(Vector3d::Zero(), {0, 0.02, 0}, wanted.force_N, 200, Vector3d::Zero());
  wanted.model.damping_Ns_m = 2;
  ForceGate gate({.max_force_N = 2, .max_slew_N_s = 1000, .ramp_s = 0.1, .fade_s = 0.05});
  for (int i = 0; i < 200; ++i) {
    const Wrench out = gate.pass({.wanted = wanted, .dt_s = 0.001});
    const double part = out.force_N.y() / 4;
    ASSERT_NEAR(out.model.stiffness_N_m(1, 1), 200 * part, 1e-9) << i;
    ASSERT_NEAR(out.model.damping_Ns_m, 2 * part, 1e-9) << i;
  }
  EXPECT_EQ(gate.sent().force_N.y(), 2);
  gate.restart();
  EXPECT_TRUE(gate.pass({.wanted = wanted, .dt_s = 0.001}).model.stiffness_N_m.isZero(0)) << "while the force fades";
  EXPECT_TRUE(gate.close().model.stiffness_N_m.isZero(0));
  wanted.model.stiffness_N_m(0, 0) = NAN;
  ForceGate open({.ramp_s = 0}, true);
  const Wrench out = open.pass({.wanted = wanted, .dt_s = 0.001});
  EXPECT_EQ(out.force_N.y(), 4);
  EXPECT_TRUE(out.model.stiffness_N_m.isZero(0)) << "a model that is no spring is left out";
}

TEST(SpringModel, IsComputedWithoutAllocationLockOrCall) {
  SpringModel spring;
  ForceGate gate({});
  test::NoAllocGuard guard;
  for (int i = 0; i < 100; ++i) {
    Wrench wrench;
    wrench.force_N = {0, 1, 0};
    wrench.model = spring.about({0, 1e-4 * i, 0}, {0, 0.005, 0}, wrench.force_N, 200, Vector3d::UnitX());
    gate.pass({.wanted = wrench, .dt_s = 0.001});
  }
  const test::ForbiddenCalls calls = guard.calls();
  EXPECT_EQ(calls.total(), 0U) << calls.first;
}

struct Given {
  double beyond_J = 0;  // energy given beyond the bound, in any window
  double most_J = 0;    // most energy given in any window
};

// Force law, gate and model at 1 kHz, a bridge at 4 kHz behind a delay of commands, and a hand that a person leads to
// and fro, in virtual time. A force is constant for a step of the bridge, so the energy is exact. Counted after the
// ramps.
Given through(double stiffness_N_m, int delay, bool models, bool controls, double seconds) {
  constexpr int kSteps = 4;
  constexpr double kStep_s = 0.00025, kReach_m = 0.03, kMass_kg = 0.15, kDamping_Ns_m = 0.5, kPull_N_m = 60;
  constexpr std::int64_t kStep_ns = 250'000;
  bridge_force bridge;
  bridge_force_begin(&bridge, 8, 0);
  ForceLawOptions options;
  options.stiffness_N_m = stiffness_N_m;
  options.passivity.on = controls;
  options.passivity.delay_samples = 1 + delay;
  ForceLaw law(options);
  const PassivityOptions& passivity = options.passivity;
  SpringModel spring;
  struct Sample {
    Vector3d p_D = Vector3d::Zero(), v_D = Vector3d::Zero(), sent_N = Vector3d::Zero();
  };
  std::vector<Sample> seen(static_cast<std::size_t>(delay) + 1);
  Vector3d p_D = Vector3d::Zero(), v_D = Vector3d::Zero();
  std::int64_t now_ns = 1'000'000'000;
  Given result;
  double given_J = 0, most_step_J = 0, credit_J = std::numeric_limits<double>::infinity(), least_J = 0;
  for (int tick = 0; tick < static_cast<int>(1000 * seconds); ++tick) {
    const double t_s = 0.001 * tick, angle = 2 * M_PI * 1.3 * t_s;
    // The master knows the sample of `delay` ticks ago.
    const Sample known = seen[static_cast<std::size_t>(tick) % seen.size()];
    if (delay == 0) law.acted(known.sent_N);  // otherwise the force of an older command
    Wrench wrench;
    wrench.force_N = law.apply(Vector3d::Zero(), known.p_D, known.v_D, 0.001);
    if (models && !law.fading())
      wrench.model = spring.about(known.p_D, -known.p_D, wrench.force_N, stiffness_N_m, Vector3d::Zero());
    fb_command command{};
    command.flags = FB_ARM;
    command.ttl_us = FB_TTL_US;
    std::copy_n(wrench.force_N.data(), 3, command.force_N);
    std::copy_n(wrench.model.at_D.data(), 3, command.at_D);
    const Matrix3d& k = wrench.model.stiffness_N_m;
    const double six[] = {k(0, 0), k(0, 1), k(0, 2), k(1, 1), k(1, 2), k(2, 2)};
    std::copy_n(six, 6, command.stiffness_N_m);
    command.radius_m = wrench.model.radius_m;
    if (delay > 0 || tick % 977 < 900 || tick % 977 > 930)  // a pause of 30 ms: the force begins to fade
      bridge_force_command(&bridge, static_cast<std::uint32_t>(tick + 1), &command, 1, now_ns);
    for (int step = 0; step < kSteps; ++step, now_ns += kStep_ns) {
      Vector3d f_N;
      bridge_force_at(&bridge, p_D.data(), v_D.data(), now_ns, f_N.data());
      if (step == 0) seen[static_cast<std::size_t>(tick) % seen.size()] = {p_D, v_D, f_N};
      const Vector3d target_D = kReach_m * Vector3d(std::sin(angle), std::sin(0.7 * angle), std::cos(angle));
      v_D += kStep_s * (f_N + kPull_N_m * (target_D - p_D) - kDamping_Ns_m * v_D) / kMass_kg;
      const Vector3d dx_D = kStep_s * v_D;
      p_D += dx_D;
      given_J += f_N.dot(dx_D);
      most_step_J = std::max(most_step_J, 4 * std::abs(f_N.dot(dx_D)));
    }
    if (t_s < 1.1) {
      given_J = most_step_J = 0;
      continue;
    }
    const double balance_J = given_J - passivity.power_W * t_s;
    credit_J = std::min(credit_J, balance_J + law.storedEnergy(p_D.norm()));
    least_J = std::min(least_J, given_J);
    const double allowed_J = passivity.energy_J + (passivity.delay_samples + 1) * most_step_J;
    result.beyond_J = std::max(result.beyond_J, balance_J - credit_J - allowed_J);
    result.most_J = std::max(result.most_J, given_J - least_J);
  }
  return result;
}

TEST(SpringModel, GivesNoMoreEnergyThanTheBoundOverStiffnessAndDelay) {
  double most_J = 0;
  for (const double stiffness_N_m : {50.0, 200.0, 800.0, 3200.0})
    for (const int delay : {0, 1, 3}) {
      const Given given = through(stiffness_N_m, delay, true, true, 4);
      EXPECT_LE(given.beyond_J, 1e-9) << stiffness_N_m << " N/m, " << delay;
      most_J = std::max(most_J, given.most_J);
    }
  EXPECT_GT(most_J, 1e-3) << "the hand is given energy, so that the bound is tried";
  EXPECT_GT(through(3200, 3, false, false, 4).beyond_J, 1e-3) << "without model and controller the bound is broken";
}

}  // namespace
}  // namespace filiform
