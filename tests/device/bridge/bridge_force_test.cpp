#include "tools/bridges/bridge_force.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <random>
#include <vector>

#include <Eigen/Core>
#include <gtest/gtest.h>

namespace filiform {
namespace {

using Eigen::Vector3d;

constexpr std::int64_t kMs = 1'000'000;

fb_command pushing(const Vector3d& force_N, std::uint32_t flags = FB_ARM) {
  fb_command c{};
  c.flags = flags;
  c.ttl_us = FB_TTL_US;
  std::copy_n(force_N.data(), 3, c.force_N);
  return c;
}

// A spring towards `centre_D`, modelled about `at_D`.
fb_command springTo(const Vector3d& centre_D, const Vector3d& at_D, double stiffness_N_m, double radius_m = 1) {
  fb_command c = pushing(stiffness_N_m * (centre_D - at_D));
  std::copy_n(at_D.data(), 3, c.at_D);
  c.stiffness_N_m[0] = c.stiffness_N_m[3] = c.stiffness_N_m[5] = stiffness_N_m;
  c.radius_m = radius_m;
  return c;
}

class BridgeForce : public testing::Test {
 protected:
  BridgeForce() {
    bridge_force_begin(&force, 8, 0);
    force.limits.slew_N_s = 1e9;
  }
  bool command(const fb_command& c, bool ready = true) {
    return bridge_force_command(&force, ++seq, &c, ready, now_ns) == 1;
  }
  Vector3d at(const Vector3d& p_D = Vector3d::Zero(), const Vector3d& v_D = Vector3d::Zero()) {
    Vector3d out_N;
    bridge_force_at(&force, p_D.data(), v_D.data(), now_ns, out_N.data());
    return out_N;
  }
  // Sends a command each millisecond until the ramp is over.
  void arm(const fb_command& c) {
    for (int i = 0; i <= 500; ++i, now_ns += kMs) {
      command(c);
      at();
    }
    now_ns -= kMs;
  }

  bridge_force force;
  std::int64_t now_ns = 1'000'000'000'000;
  std::uint32_t seq = 0;
};

TEST_F(BridgeForce, NeedsToBeArmed) {
  EXPECT_FALSE(command(pushing({1, 0, 0}, 0)));
  EXPECT_EQ(at(), Vector3d::Zero());
  EXPECT_FALSE(command(pushing({1, 0, 0}), false)) << "the device is not ready";
  EXPECT_EQ(force.refused, 0U);
  EXPECT_TRUE(command(pushing({1, 0, 0})));
  EXPECT_EQ(force.mode, BRIDGE_ARMED);
}

TEST_F(BridgeForce, GrowsFromZeroAfterItIsArmed) {
  Vector3d last_N = Vector3d::Zero();
  for (int i = 0; i <= 1000; ++i, now_ns += kMs) {
    ASSERT_TRUE(command(pushing({0, 2, 0})));
    const Vector3d f_N = at();
    EXPECT_NEAR(f_N.y(), 2 * std::min(1.0, i / 500.0), 1e-12);
    EXPECT_LE((f_N - last_N).norm(), 2 * 0.002 + 1e-12);
    last_N = f_N;
  }
}

TEST_F(BridgeForce, FadesAfterTheTimeToLive) {
  arm(pushing({0, 0, 3}));
  const std::int64_t last_ns = now_ns;
  EXPECT_EQ(at(), Vector3d(0, 0, 3));
  now_ns = last_ns + 20 * kMs - 1;
  EXPECT_EQ(at(), Vector3d(0, 0, 3)) << "until the time to live is over";
  for (const int ms : {20, 30, 45, 60, 69}) {
    now_ns = last_ns + ms * kMs;
    EXPECT_NEAR(at().z(), 3 * (70 - ms) / 50.0, 1e-12) << ms;
    EXPECT_EQ(force.mode, BRIDGE_FADING);
  }
  now_ns = last_ns + 70 * kMs - 1;
  EXPECT_GT(at().z(), 0);
  now_ns = last_ns + 70 * kMs;
  EXPECT_EQ(at(), Vector3d::Zero()) << "exactly 20 ms and 50 ms after the last command";
  EXPECT_EQ(force.mode, BRIDGE_OFF);
}

TEST_F(BridgeForce, FadesAlsoIfItIsAskedOnlyOnceAfterwards) {
  for (const int ms : {69, 70, 71, 10'000}) {
    bridge_force_begin(&force, 8, 0);
    force.limits.slew_N_s = 1e9;
    seq = 0;
    arm(pushing({0, 0, 3}));
    now_ns += ms * kMs;
    EXPECT_EQ(at().norm() > 0, ms < 70) << ms;
  }
}

TEST_F(BridgeForce, ShortensTheTimeToLive) {
  fb_command c = pushing({0, 0, 3});
  arm(c);
  c.ttl_us = 5000;
  command(c);
  now_ns += 5 * kMs;
  at();
  EXPECT_EQ(force.mode, BRIDGE_FADING);
  c.ttl_us = 4'000'000'000U;
  now_ns += 100 * kMs;
  ASSERT_TRUE(command(c));
  now_ns += 20 * kMs;
  at();
  EXPECT_EQ(force.mode, BRIDGE_FADING) << "a longer time counts as 20 ms";
}

TEST_F(BridgeForce, GrowsAgainFromThePresentPartAfterAStall) {
  for (const int ms : {12, 20, 30, 45, 69}) {
    bridge_force_begin(&force, 8, 0);
    force.limits.slew_N_s = 1e9;
    seq = 0;
    arm(pushing({0, 0, 3}));
    now_ns += ms * kMs;
    const double part = std::min(1.0, (70 - ms) / 50.0);
    EXPECT_TRUE(command(pushing({0, 0, 3}, 0))) << "also without ARM";
    for (int i = 0; i <= 60; ++i, now_ns += kMs) {
      command(pushing({0, 0, 3}, 0));
      EXPECT_NEAR(at().z(), 3 * std::min(1.0, part + i / 50.0), 1e-12) << ms << " ms, then " << i;
    }
  }
}

TEST_F(BridgeForce, RampsAgainAfterAnExpiry) {
  arm(pushing({0, 0, 3}));
  now_ns += 70 * kMs;
  EXPECT_FALSE(command(pushing({0, 0, 3}, 0))) << "only with ARM";
  EXPECT_EQ(at(), Vector3d::Zero());
  EXPECT_TRUE(command(pushing({0, 0, 3})));
  EXPECT_EQ(at(), Vector3d::Zero());
  now_ns += 10 * kMs;
  EXPECT_NEAR(at().z(), 3 * 0.02, 1e-12);
}

TEST_F(BridgeForce, FadesFromTheRampWithoutAStep) {
  for (int i = 0; i <= 100; ++i, now_ns += kMs) command(pushing({5, 0, 0}));
  now_ns -= kMs;
  now_ns += 20 * kMs;
  const double part = 120 / 500.0;
  EXPECT_NEAR(at().x(), 5 * part, 1e-12);
  now_ns += 25 * kMs;
  EXPECT_NEAR(at().x(), 5 * part / 2, 1e-12);
  for (int i = 0; i <= 500; ++i, now_ns += kMs) {
    command(pushing({5, 0, 0}, 0));
    EXPECT_NEAR(at().x(), 5 * std::min(1.0, part / 2 + i / 500.0), 1e-12) << "as slowly as before, at " << i;
  }
}

TEST_F(BridgeForce, EndsWithItsMaster) {
  arm(pushing({0, 0, 3}));
  bridge_force_end(&force, now_ns);
  EXPECT_EQ(at(), Vector3d(0, 0, 3)) << "no step";
  now_ns += 25 * kMs;
  EXPECT_NEAR(at().z(), 1.5, 1e-12);
  EXPECT_FALSE(command(pushing({0, 0, 3}))) << "the fade goes on";
  EXPECT_NEAR(at().z(), 1.5, 1e-12);
  now_ns += 25 * kMs;
  EXPECT_EQ(at(), Vector3d::Zero()) << "50 ms after the end";
  bridge_force_end(&force, now_ns);
  seq = 0;
  EXPECT_TRUE(command(pushing({0, 0, 3}))) << "the next master counts from 1";
}

TEST_F(BridgeForce, RefusesNumbersThatAreNotFinite) {
  arm(pushing({0, 0, 3}));
  const double wrong[] = {std::nan(""), INFINITY, -INFINITY, 1e300};
  std::uint32_t refused = 0;
  for (const double value : wrong) {
    for (int field = 0; field < 14; ++field) {
      fb_command c = springTo({0, 0, 0.01}, {0, 0, 0}, 100);
      double* const fields[] = {&c.force_N[0],       &c.force_N[1],       &c.force_N[2],       &c.at_D[0],
                                &c.at_D[1],          &c.at_D[2],          &c.stiffness_N_m[0], &c.stiffness_N_m[1],
                                &c.stiffness_N_m[2], &c.stiffness_N_m[3], &c.stiffness_N_m[4], &c.stiffness_N_m[5],
                                &c.damping_Ns_m,     &c.radius_m};
      if (value == 1e300 && field == 13) continue;  // a radius may be great
      *fields[field] = value;
      EXPECT_FALSE(command(c)) << value << " in " << field;
      EXPECT_EQ(force.refused, ++refused);
      EXPECT_EQ(at(), Vector3d(0, 0, 3)) << "the last command stays, until it expires";
    }
  }
  for (const int field : {0, 1, 2, 3}) {
    fb_command c = springTo({0, 0, 0.01}, {0, 0, 0}, 100);
    *(field == 0   ? &c.damping_Ns_m
      : field == 1 ? &c.radius_m
      : field == 2 ? &c.stiffness_N_m[3]
                   : &c.stiffness_N_m[1]) = field == 3 ? 101 : -1;
    EXPECT_FALSE(command(c)) << "negative: " << field;
  }
  now_ns += 70 * kMs;
  EXPECT_EQ(at(), Vector3d::Zero()) << "refused commands do not prolong the force";
}

TEST_F(BridgeForce, IsZeroAtAPositionThatIsNotFinite) {
  arm(springTo({0, 0, 0.01}, {0, 0, 0}, 100));
  EXPECT_EQ(at({std::nan(""), 0, 0}), Vector3d::Zero());
  EXPECT_EQ(at({0, 0, 0}, {0, INFINITY, 0}), Vector3d::Zero());
  now_ns += kMs;
  EXPECT_NEAR(at().z(), 1, 1e-12);
}

TEST_F(BridgeForce, RefusesReorderedAndRepeatedPacketsAndCountsLostOnes) {
  arm(pushing({0, 0, 3}));
  const std::uint32_t last = seq;
  const fb_command other = pushing({3, 0, 0});
  for (const std::uint32_t old : {last, last - 1, last - 100, 1U, last + 0x80000000U}) {
    EXPECT_EQ(bridge_force_command(&force, old, &other, 1, now_ns), 0);
    EXPECT_EQ(at(), Vector3d(0, 0, 3));
  }
  EXPECT_EQ(force.refused, 5U);
  EXPECT_EQ(force.lost, 0U);
  EXPECT_EQ(bridge_force_command(&force, last + 4, &other, 1, now_ns), 1) << "newest wins";
  EXPECT_EQ(force.lost, 3U);
  EXPECT_EQ(bridge_force_command(&force, last + 3, &other, 1, now_ns), 0) << "it came too late";
}

TEST_F(BridgeForce, GoesOnWhenTheNumbersOfPacketsWrap) {
  seq = 0xffffff00U;
  arm(pushing({0, 0, 3}));
  EXPECT_EQ(force.refused + force.lost, 0U);
  EXPECT_EQ(at(), Vector3d(0, 0, 3));
}

TEST_F(BridgeForce, FollowsTheLocalModelBetweenCommands) {
  arm(springTo({0, 0, 0.01}, {0, 0, 0.002}, 200, 0.005));
  EXPECT_NEAR((at({0, 0, 0.002}) - Vector3d(0, 0, 1.6)).norm(), 0, 1e-12);
  EXPECT_NEAR((at({0.001, 0, 0.004}) - Vector3d(-0.2, 0, 1.2)).norm(), 0, 1e-12);
  EXPECT_NEAR((at({0, 0, 0.052}) - Vector3d(0, 0, 0.6)).norm(), 0, 1e-12) << "at the radius";
  fb_command c = pushing({0, 0, 0});
  c.damping_Ns_m = 2;
  command(c);
  EXPECT_NEAR((at({0, 0, 0}, {0.1, 0, -0.2}) - Vector3d(-0.2, 0, 0.4)).norm(), 0, 1e-12);
}

TEST_F(BridgeForce, LowersAStiffnessAboveTheDevicesLimit) {
  force.limits.max_stiffness_N_m = 100;
  arm(springTo({0, 0, 0.01}, {0, 0, 0}, 100));
  EXPECT_EQ(force.lowered, 0);
  command(springTo({0, 0, 0.01}, {0, 0, 0}, 400));
  EXPECT_EQ(force.lowered, 1);
  now_ns += kMs;
  EXPECT_NEAR((at({0.001, 0, 0}) - Vector3d(-0.1, 0, 4)).norm(), 0, 1e-12);
}

// Whatever a master sends, whenever, and wherever the hand is.
TEST_F(BridgeForce, KeepsTheBoundsOfForceAndSlew) {
  std::mt19937_64 random(28);
  std::uniform_real_distribution<double> one(-1, 1);
  const auto vector = [&](double size) { return Vector3d(size * Vector3d(one(random), one(random), one(random))); };
  bridge_force_begin(&force, 8, 1000);
  Vector3d last_N = Vector3d::Zero(), p_D = vector(0.05);
  for (int i = 0; i < 200'000; ++i) {
    const auto dt_ns = static_cast<std::int64_t>(std::abs(one(random)) * (i % 997 == 0 ? 80 : 2) * kMs);
    now_ns += dt_ns;
    const Vector3d before_D = p_D;
    p_D = i % 501 == 0 ? vector(0.1) : Vector3d(p_D + vector(0.001));
    if (random() % 3 != 0) {
      fb_command c = springTo(p_D + vector(0.05), p_D + vector(0.01), 500 * (1 + one(random)), 0.01);
      if (random() % 50 == 0) c.force_N[random() % 3] = one(random) * 1e5;
      c.damping_Ns_m = 5 * (1 + one(random));
      if (random() % 20 == 0) c.at_D[1] = std::nan("");
      c.flags = random() % 2;
      seq += static_cast<std::uint32_t>(random() % 4) - 1U;
      bridge_force_command(&force, seq, &c, random() % 100 != 0, now_ns);
    }
    if (random() % 2000 == 0) bridge_force_end(&force, now_ns);
    const double stiffness = force.command.stiffness_N_m[0];
    const Vector3d f_N = at(p_D, vector(0.5));
    ASSERT_TRUE(f_N.allFinite());
    ASSERT_LE(f_N.norm(), 8 * (1 + 1e-12));
    const double dt_s = std::min(0.01, 1e-9 * static_cast<double>(dt_ns));
    const double kept_N = f_N.norm() > 0 ? std::clamp(last_N.dot(f_N) / f_N.norm(), 0.0, f_N.norm()) : 0;
    ASSERT_LE(f_N.norm(), kept_N + 1000 * dt_s + stiffness * std::min(dt_s, (p_D - before_D).norm()) + 1e-9);
    last_N = f_N;
  }
}

// The energy that the force gives is at most the energy of the spring, what the ramp adds, and what a force that is
// held for a period adds to a spring: K |dx|^2 / 2. Scaled by the part of the model that is rendered.
TEST_F(BridgeForce, GivesNoEnergyBeyondTheBound) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> one(-1, 1);
  double worst_J = -1;
  for (int run = 0; run < 300; ++run) {
    const double stiffness_N_m = 20 * std::pow(100, std::abs(one(random)));
    const double period_s = run % 2 == 0 ? 0.001 : 0.00025;
    const auto period_ns = static_cast<std::int64_t>(std::llround(1e9 * period_s));
    const Vector3d centre_D = 0.01 * Vector3d(one(random), one(random), one(random));
    bridge_force_begin(&force, 1e5, 0);
    force.limits.slew_N_s = 1e9;
    seq = 0;
    // A hand of 0.15 kg and 5 N s/m, pulled about by a force that changes at random.
    Vector3d p_D = Vector3d::Zero(), v_D = Vector3d::Zero(), pull_N = Vector3d::Zero();
    const auto stored_J = [&] { return stiffness_N_m * (p_D - centre_D).squaredNorm() / 2; };
    const int kept = 400 + static_cast<int>(random() % 400);  // ticks with commands
    double given_J = 0, bound_J = 0, last_part = 0, most_J = 0;
    std::int64_t stalled_ns = 0;  // no command until then
    for (int i = 0; i < kept + 400; ++i, now_ns += period_ns) {
      if (random() % 200 == 0) stalled_ns = now_ns + static_cast<std::int64_t>((12 + random() % 34) * kMs);
      if (i < kept && i % 4 == 0 && now_ns >= stalled_ns) command(springTo(centre_D, p_D, stiffness_N_m, 10));
      const Vector3d f_N = at(p_D, v_D);
      const double extension_m = (centre_D - p_D).norm();
      const double part = extension_m > 0 ? f_N.norm() / (stiffness_N_m * extension_m) : last_part;
      bound_J += std::max(0.0, part - last_part) * stored_J();
      last_part = part;
      if (i % 50 == 0) pull_N = 3 * Vector3d(one(random), one(random), one(random));
      v_D += period_s * (f_N + pull_N - 5 * v_D) / 0.15;
      const Vector3d dx_D = period_s * v_D;
      p_D += dx_D;
      given_J += f_N.dot(dx_D);
      bound_J += part * stiffness_N_m * dx_D.squaredNorm() / 2;
      most_J = std::max(most_J, given_J - bound_J);
      ASSERT_LE(given_J - bound_J, 1e-9) << "run " << run << ", tick " << i;
    }
    EXPECT_EQ(at(p_D, v_D), Vector3d::Zero());
    worst_J = std::max(worst_J, most_J);
  }
  std::printf("energy given beyond the bound: at most %.2e J\n", worst_J);
}

// A hand at rest at the other end, over stiffness and delay: within the bound b / (T/2 + d) it does not vibrate.
TEST_F(BridgeForce, IsStableWithinTheBoundOverStiffnessAndDelay) {
  constexpr double kHand_kg = 0.15, kDamping_Ns_m = 5.5;
  std::printf("delay_ms bound_N_m: largest motion after 4 s, m, of a start at 5 mm; at .5 .9 2 times the bound\n");
  for (const int delay :
       {0, 1, 2, 4}) {  // periods of 1 ms, of the command; the model's stiffness is held at the master
    const double bound_N_m = kDamping_Ns_m / (0.0005 + 0.001 * delay);
    std::printf("%d %.0f:", delay, bound_N_m);
    for (const double share : {0.5, 0.9, 2.0}) {
      bridge_force_begin(&force, 1e6, 0);
      force.limits.slew_N_s = 1e9;
      force.limits.ramp_ns = 1;
      seq = 0;
      std::vector<Vector3d> seen(static_cast<std::size_t>(delay) + 1, Vector3d::Zero());
      Vector3d p_D(0.005, 0, 0), v_D = Vector3d::Zero();
      double most_m = 0;
      for (int i = 0; i < 5000; ++i, now_ns += kMs) {
        seen[static_cast<std::size_t>(i % (delay + 1))] = p_D;
        const Vector3d known_D =
            i < delay ? Vector3d(0.005, 0, 0) : seen[static_cast<std::size_t>((i - delay) % (delay + 1))];
        command(pushing(-share * bound_N_m * known_D));
        const Vector3d f_N = at(p_D, v_D);
        for (int part = 0; part < 50; ++part) {
          v_D += 2e-5 * (f_N - kDamping_Ns_m * v_D) / kHand_kg;
          p_D += 2e-5 * v_D;
        }
        if (i > 4000) most_m = std::max(most_m, p_D.norm());
      }
      std::printf(" %.1e", most_m);
      if (share < 1) {
        EXPECT_LT(most_m, 0.005) << delay << " periods, " << share;
      } else {
        EXPECT_GT(most_m, 0.005) << delay << " periods, " << share << ": the sweep sees instability";
      }
    }
    std::printf("\n");
  }
}

// The local model takes the delay out of the spring: the bridge renders it at its own rate.
TEST_F(BridgeForce, IsStableWithALocalModelAtAnyDelayOfCommands) {
  for (const int delay : {0, 1, 2, 4, 8}) {
    bridge_force_begin(&force, 1e6, 0);
    force.limits.slew_N_s = 1e9;
    force.limits.ramp_ns = 1;
    seq = 0;
    std::vector<Vector3d> seen(static_cast<std::size_t>(delay) + 1, Vector3d(0.005, 0, 0));
    Vector3d p_D(0.005, 0, 0), v_D = Vector3d::Zero();
    const double stiffness_N_m = 0.9 * 5.5 / 0.0005;  // of a period of 1 ms without delay
    for (int i = 0; i < 5000; ++i, now_ns += kMs) {
      seen[static_cast<std::size_t>(i % (delay + 1))] = p_D;
      command(springTo(Vector3d::Zero(), seen[static_cast<std::size_t>((i + 1) % (delay + 1))], stiffness_N_m));
      const Vector3d f_N = at(p_D, v_D);
      for (int part = 0; part < 50; ++part) {
        v_D += 2e-5 * (f_N - 5.5 * v_D) / 0.15;
        p_D += 2e-5 * v_D;
      }
    }
    EXPECT_LT(p_D.norm(), 0.005) << delay;
  }
}

}  // namespace
}  // namespace filiform
