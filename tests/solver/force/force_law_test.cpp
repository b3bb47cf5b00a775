#include "solver/force/force_law.h"

#include "index/errors.h"
#include "tests/support/numbers.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <random>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using Eigen::Vector3d;
using test::kInfinity;
using test::kNaN;
using test::logUniform;

const Vector3d kZero = Vector3d::Zero();

// A force law without ramp; other limits are out of the way if a test needs only the spring.
ForceLawOptions bare(double stiffness_N_m = 200) {
  ForceLawOptions options;
  options.stiffness_N_m = stiffness_N_m;
  options.max_slew_N_s = 1e12;
  options.ramp_s = 0;
  return options;
}

Vector3d wild(std::mt19937_64& random) {
  Vector3d v;
  for (int axis = 0; axis < 3; ++axis) {
    const int kind = static_cast<int>(random() % 40);
    const double size = logUniform(random, 1e-12, kind == 3 ? 1e308 : 1.0);
    v[axis] = kind == 0 ? kNaN : kind == 1 ? kInfinity : kind == 2 ? -kInfinity : random() % 2 ? size : -size;
  }
  return v;
}

TEST(ForceLaw, IsASpringFromProbeToProxy) {
  ForceLaw law(bare());
  const Vector3d force = law.apply({0.01, 0, -0.02}, {0, 0.005, 0}, kZero, 1e-3);
  EXPECT_NEAR(force.x(), 2.0, 1e-12);
  EXPECT_NEAR(force.y(), -1.0, 1e-12);
  EXPECT_NEAR(force.z(), -4.0, 1e-12);
}

TEST(ForceLaw, DampingOpposesVelocityAndIsOffByDefault) {
  ForceLawOptions options = bare();
  EXPECT_EQ(ForceLaw(options).apply(kZero, kZero, {0.1, 0, 0}, 1e-3), kZero);
  options.damping_Ns_m = 2;
  EXPECT_NEAR(ForceLaw(options).apply(kZero, kZero, {0.1, 0, 0}, 1e-3).x(), -0.2, 1e-12);
}

TEST(ForceLaw, VelocityThatIsNotFiniteMattersOnlyWithDamping) {
  ForceLaw undamped(bare());
  EXPECT_NEAR(undamped.apply({0.01, 0, 0}, kZero, {kNaN, 0, 0}, 1e-3).x(), 2.0, 1e-12);
  ForceLawOptions options = bare();
  options.damping_Ns_m = 1;
  ForceLaw damped(options);
  EXPECT_EQ(damped.apply({0.01, 0, 0}, kZero, {kNaN, 0, 0}, 1e-3), kZero);
  EXPECT_EQ(damped.events().not_finite, 1u);
}

TEST(ForceLaw, NotFiniteGoesToZeroAtOnceAndIsCounted) {
  ForceLaw law(bare());
  ASSERT_GT(law.apply({0.01, 0, 0}, kZero, kZero, 1e-3).norm(), 1.0);
  std::uint64_t faults = 0;
  for (const double bad : {kNaN, kInfinity, -kInfinity}) {
    EXPECT_EQ(law.apply({bad, 0, 0}, kZero, kZero, 1e-3), kZero);
    EXPECT_EQ(law.apply(kZero, {0, bad, 0}, kZero, 1e-3), kZero);
    faults += 2;
    EXPECT_EQ(law.events().not_finite, faults);
  }
  // A spring so long that its force overflows is a fault, not a clamped force.
  EXPECT_EQ(law.apply({1e307, 0, 0}, kZero, kZero, 1e-3), kZero);
  EXPECT_EQ(law.events().not_finite, faults + 1);
}

TEST(ForceLaw, ClampKeepsDirection) {
  ForceLaw law(bare());
  const Vector3d force = law.apply({3, 4, 0}, kZero, kZero, 1e-3);
  EXPECT_NEAR(force.norm(), 8.0, 1e-12);
  EXPECT_NEAR(force.x() / force.y(), 0.75, 1e-12);
  EXPECT_EQ(law.events().clamped, 1u);
}

TEST(ForceLaw, IncreasesAreLimitedAndDecreasesPassAtOnce) {
  ForceLawOptions options;
  options.ramp_s = 0;
  ForceLaw law(options);
  for (int tick = 1; tick <= 10; ++tick)
    EXPECT_NEAR(law.apply({0.01, 0, 0}, kZero, kZero, 1e-3).x(), 0.1 * tick, 1e-12);
  EXPECT_EQ(law.events().slewed, 10u);
  EXPECT_NEAR(law.apply({0.001, 0, 0}, kZero, kZero, 1e-3).x(), 0.2, 1e-12);
  EXPECT_EQ(law.events().slewed, 10u);
}

TEST(ForceLaw, TheHandsOwnMotionIsNotSlewed) {
  // 0.5 m/s against 2000 N/m is 1 N a tick; 2 m/s counts as 1 m/s.
  for (const double speed : {0.5, 2.0}) {
    ForceLawOptions options;
    options.ramp_s = 0;
    options.stiffness_N_m = 2000;
    ForceLaw law(options);
    law.apply(kZero, kZero, kZero, 1e-3);
    const double force = law.apply(kZero, {-speed * 1e-3, 0, 0}, kZero, 1e-3).x();
    EXPECT_NEAR(force, speed < 1 ? 1.0 : 2.0 + 0.1, 1e-12);
    EXPECT_EQ(law.events().slewed, speed < 1 ? 0u : 1u);
  }
}

TEST(ForceLaw, ReversedForceStartsFromZero) {
  ForceLawOptions options;
  options.ramp_s = 0;
  ForceLaw law(options);
  for (int tick = 0; tick < 100; ++tick) law.apply({0.01, 0, 0}, kZero, kZero, 1e-3);
  EXPECT_NEAR(law.apply({-0.01, 0, 0}, kZero, kZero, 1e-3).x(), -0.1, 1e-12);
}

TEST(ForceLaw, RampGrowsFromZeroAndRestarts) {
  ForceLawOptions options = bare();
  options.ramp_s = 0.5;
  ForceLaw law(options);
  for (int round = 0; round < 2; ++round) {
    for (int tick = 0; tick <= 600; ++tick) {
      const double force = law.apply({0.01, 0, 0}, kZero, kZero, 1e-3).x();
      ASSERT_NEAR(force, 2.0 * std::min(1.0, tick / 500.0), 1e-9) << tick;
    }
    law.restartFromZero();
  }
}

TEST(ForceLaw, ReleaseIsZeroAndTheNextForceGrowsFromZero) {
  ForceLawOptions options;
  options.ramp_s = 0;
  ForceLaw law(options);
  for (int tick = 0; tick < 100; ++tick) law.apply({0.01, 0, 0}, kZero, kZero, 1e-3);
  EXPECT_EQ(law.release(), kZero);
  EXPECT_NEAR(law.apply({0.01, 0, 0}, kZero, kZero, 1e-3).norm(), 0.1, 1e-12);
}

TEST(ForceLaw, TimeStepThatIsNoTimeAddsNoForce) {
  for (const double dt : {0.0, -1.0, kNaN, kInfinity}) {
    ForceLawOptions options;
    options.ramp_s = 0;
    EXPECT_EQ(ForceLaw(options).apply({0.01, 0, 0}, kZero, kZero, dt), kZero) << dt;
  }
}

TEST(ForceLaw, BoundsHoldForAnyInput) {
  constexpr std::uint64_t kSeed = 20261121;
  SCOPED_TRACE(kSeed);
  std::mt19937_64 random(kSeed);
  for (int law_number = 0; law_number < 300; ++law_number) {
    ForceLawOptions options;
    options.stiffness_N_m = logUniform(random, 1e-3, 1e6);
    options.damping_Ns_m = random() % 2 ? 0.0 : logUniform(random, 1e-3, 1e3);
    options.max_force_N = logUniform(random, 1e-2, 50);
    options.max_slew_N_s = logUniform(random, 1, 1e4);
    options.ramp_s = random() % 3 ? logUniform(random, 1e-3, 2) : 0.0;
    options.free_speed_m_s = random() % 3 ? logUniform(random, 1e-3, 10) : 0.0;
    ForceLaw law(options);
    Vector3d last = kZero;
    for (int tick = 0; tick < 300; ++tick) {
      const double dt = logUniform(random, 1e-6, 1.0);
      if (random() % 50 == 0) law.restartFromZero();
      const Vector3d p_D = wild(random), h_D = wild(random), v_D = wild(random);
      const Vector3d force = law.apply(p_D, h_D, v_D, dt);
      ASSERT_TRUE(force.allFinite());
      ASSERT_LE(force.norm(), options.max_force_N * (1 + 1e-12));
      double growth = options.max_slew_N_s + options.stiffness_N_m * options.free_speed_m_s;
      if (options.ramp_s > 0) growth += options.max_force_N / options.ramp_s;
      // The ramp's last step ends at 1. In a longer tick, the force may grow by the whole step.
      ASSERT_LE(force.norm(), last.norm() + growth * dt + 1e-12) << "dt " << dt;
      const Vector3d spring =
          options.stiffness_N_m * (p_D - h_D) - (options.damping_Ns_m > 0 ? options.damping_Ns_m * v_D : kZero);
      if (!spring.allFinite()) {
        ASSERT_EQ(force, kZero);
      } else if (force.norm() > 0) {
        ASSERT_GT(force.normalized().dot((spring / spring.cwiseAbs().maxCoeff()).normalized()), 1 - 1e-9);
      }
      last = force;
    }
  }
}

TEST(ForceLaw, RefusesOptionsOutOfRange) {
  for (const double bad : {kNaN, kInfinity, -1.0}) {
    for (double ForceLawOptions::*option :
         {&ForceLawOptions::stiffness_N_m, &ForceLawOptions::damping_Ns_m, &ForceLawOptions::max_force_N,
          &ForceLawOptions::max_slew_N_s, &ForceLawOptions::free_speed_m_s, &ForceLawOptions::ramp_s}) {
      ForceLawOptions options;
      options.*option = bad;
      EXPECT_THROW(ForceLaw{options}, UsageError);
    }
  }
}

TEST(ForceLaw, ACommandLetsTheForceFadeBeforeTheRamp) {
  ForceLawOptions options = bare();
  options.max_slew_N_s = 100;
  options.ramp_s = 0.5;
  for (const bool constrained : {true, false}) {
    ForceLaw law(options);
    double last_N = 0;
    for (int tick = 0; tick < 600; ++tick) last_N = law.apply({0.005, 0, 0}, kZero, kZero, 1e-3).x();
    ASSERT_NEAR(last_N, 1, 1e-9);
    law.restart();
    for (int tick = 1; tick < 50; ++tick) {
      const Vector3d force = constrained ? law.apply({0, 0.01, 0}, kZero, kZero, 1e-3) : law.applyNothing(kZero, 1e-3);
      EXPECT_NEAR(force.x(), 1 - tick / 50.0, 1e-9);
      EXPECT_EQ(force.y(), 0);
    }
    for (int tick = 0; tick < 600 && constrained; ++tick) last_N = law.apply({0, 0.01, 0}, kZero, kZero, 1e-3).y();
    if (constrained) {
      EXPECT_NEAR(last_N, 2, 1e-9);
    }
    law.restart();
    law.restartFromZero();
    EXPECT_EQ(law.applyNothing(kZero, 1e-3), kZero);
  }
}

// A hand at rest was pulled. It then moves 50 mm without force, and comes onto the neurites again.
TEST(ForceLaw, MotionWithoutForceGivesNoEnergy) {
  ForceLawOptions options = bare();
  options.passivity.on = true;
  ForceLaw law(options);
  for (int tick = 0; tick < 20; ++tick) law.apply({0.015, 0, 0}, kZero, kZero, 1e-3);
  law.restart();
  for (int tick = 0; tick < 200; ++tick) law.applyNothing(kZero, 1e-3);
  Vector3d h_D = kZero;
  for (int tick = 0; tick < 1000; ++tick) law.applyNothing(h_D += Vector3d(5e-5, 0, 0), 1e-3);
  law.restart();
  for (int tick = 0; tick < 20; ++tick) law.apply(h_D + Vector3d(0.005, 0, 0), h_D, kZero, 1e-3);
  // All forces during the rest may have acted on its first step, of 50 um.
  EXPECT_GT(law.energy().weakest, 0.8);
}

TEST(Stiffness, BoundIsThatOfASampledDelayedSpring) {
  EXPECT_NEAR(stiffnessBound(2, 1e-3, 0), 4000, 1e-9);
  EXPECT_NEAR(stiffnessBound(2, 1e-3, 1), 4000.0 / 3, 1e-9);
  EXPECT_NEAR(stiffnessBound(2, 1e-3, 2), 800, 1e-9);
  EXPECT_NEAR(stiffnessBound(2, 1e-3, 0, 0.5), 3000, 1e-9);
  EXPECT_NEAR(stiffnessBound(2, 1e-3, 0, -0.5), 3000, 1e-9);
  EXPECT_EQ(stiffnessBound(2, 1e-3, 1, 3), 0);
}

// The criterion of Colgate and Schenkel (1994), at every frequency up to Nyquist's: the damping b must exceed
// T/2 Re{(1 - z^-1) H(z)} / (1 - cos wT), with H(z) = z^-d (K + B (z - 1) / (T z)).
TEST(Stiffness, BoundKeepsColgateAndSchenkelsCriterionWithVirtualDampingAndDelay) {
  const double period_s = 1e-3;
  const auto leastDamping = [&](double stiffness, double virtual_damping, int delay) {
    double most = 0;
    for (int i = 1; i <= 20000; ++i) {
      const std::complex<double> z = std::polar(1.0, M_PI * i / 20000);
      const std::complex<double> h = std::pow(z, -delay) * (stiffness + virtual_damping * (z - 1.0) / (period_s * z));
      most = std::max(most, period_s / 2 * ((1.0 - 1.0 / z) * h).real() / (1 - z.real()));
    }
    return most;
  };
  for (const int delay : {0, 1, 2}) {
    for (const double virtual_damping : {0.0, 0.3, 1.5}) {
      const double damping = 2, bound = stiffnessBound(damping, period_s, delay, virtual_damping);
      EXPECT_LE(leastDamping(bound, virtual_damping, delay), damping * (1 + 1e-4)) << delay << ' ' << virtual_damping;
      if (delay == 0 || virtual_damping == 0) {  // the bound is exact
        EXPECT_GT(leastDamping(1.01 * bound, virtual_damping, delay), damping);
      }
    }
  }
}

TEST(Stiffness, DefaultHeedsDampingAndTheDevicesLimit) {
  DeviceCapabilities device;
  EXPECT_EQ(defaultStiffness(device, 1e-3), 200);
  device.damping_Ns_m = 0.3;
  device.delay_samples = 1;
  EXPECT_NEAR(defaultStiffness(device, 1e-3), 0.8 * 200, 1e-9);
  device.damping_Ns_m = 5;
  EXPECT_EQ(defaultStiffness(device, 1e-3), 200);
  device.max_stiffness_N_m = 120;
  EXPECT_EQ(defaultStiffness(device, 1e-3), 120);
}

}  // namespace
}  // namespace filiform
