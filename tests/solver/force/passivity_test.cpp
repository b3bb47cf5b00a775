#include "solver/force/passivity.h"

#include "index/errors.h"
#include "solver/force/force_law.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using Eigen::Vector3d;

double uniform(std::mt19937_64& random, double lo, double hi) {
  return lo + (hi - lo) * static_cast<double>(random() >> 11) * 0x1p-53;
}

Vector3d inBox(std::mt19937_64& random, double half) {
  return {uniform(random, -half, half), uniform(random, -half, half), uniform(random, -half, half)};
}

// The energy given to the hand, computed without the controller's rules, by forces that act `delay` ticks late.
class Ledger {
 public:
  explicit Ledger(int delay) : delay_(static_cast<std::size_t>(delay)) {}
  // `force_N` was sent after the hand was at h_D.
  void tick(const Vector3d& h_D, const Vector3d& force_N) {
    if (!forces_.empty()) {
      const Vector3d dh_D = h_D - h_D_;
      longest_m_ = std::max(longest_m_, dh_D.norm());
      // forces_.back() was sent in the tick before: with delay 0 it has acted since then.
      given_.push_back(given_.back() +
                       (forces_.size() > delay_ ? forces_[forces_.size() - 1 - delay_].dot(dh_D) : 0.0));
    } else {
      given_.push_back(0.0);
    }
    h_D_ = h_D;
    forces_.push_back(force_N);
  }
  double given(std::size_t tick) const { return given_[tick]; }
  std::size_t ticks() const { return given_.size(); }
  double longest() const { return longest_m_; }

 private:
  std::size_t delay_;
  std::vector<Vector3d> forces_;
  std::vector<double> given_;
  Vector3d h_D_ = Vector3d::Zero();
  double longest_m_ = 0;
};

ForceLawOptions lawWith(double stiffness_N_m, int delay, bool on) {
  ForceLawOptions options;
  options.stiffness_N_m = stiffness_N_m;
  options.ramp_s = 0;
  options.max_slew_N_s = 1e9;
  options.passivity.on = on;
  options.passivity.delay_samples = delay;
  return options;
}

// A hand that knows the proxy and pumps: it moves out against the weak old force and in with the strong new force.
TEST(PassivityController, EnergyNeverFallsBelowTheStatedBoundWhateverHappens) {
  std::mt19937_64 random(17);
  for (int round = 0; round < 120; ++round) {
    const int delay = static_cast<int>(random() % (PassivityOptions::kMaxDelay + 1));
    const double stiffness = std::pow(10.0, uniform(random, -3, 6));
    const double dt = std::pow(10.0, uniform(random, -6, 0));
    ForceLawOptions options = lawWith(stiffness, delay, true);
    options.passivity.energy_J = std::pow(10.0, uniform(random, -5, -1));
    options.passivity.power_W = round % 3 == 0 ? 0.0 : std::pow(10.0, uniform(random, -5, -1));
    options.passivity.max_damping_Ns_m = round % 4 == 0 ? 0.0 : uniform(random, 0, 50);
    if (round % 5 == 0) options.damping_Ns_m = uniform(random, 0, 20);
    if (round % 2 == 0) {
      options.max_slew_N_s = std::pow(10.0, uniform(random, 0, 4));
      options.ramp_s = 0.3;
    }
    ForceLaw law(options);
    Ledger ledger(delay);
    const int kind = round % 4;
    Vector3d p_D = Vector3d::Zero(), h_D = Vector3d::Zero();
    const double reach = std::pow(10.0, uniform(random, -4, -1));
    std::vector<double> stored;
    for (int tick = 0; tick < 600; ++tick) {
      const Vector3d before_D = h_D;
      if (kind == 0) h_D = inBox(random, reach);                                 // jumps each tick
      if (kind == 1) h_D = {reach * std::sin(0.3 * tick), 0, 0};                 // pumps
      if (kind == 2) h_D = tick % 2 ? Vector3d(reach, 0, 0) : Vector3d::Zero();  // reverses each tick
      if (kind == 3) h_D += 0.2 * (p_D - h_D) + inBox(random, 0.1 * reach);      // yields
      if (random() % 5 == 0) p_D = inBox(random, reach);                         // the proxy jumps
      const Vector3d force = law.apply(p_D, h_D, (h_D - before_D) / dt, random() % 50 == 0 ? 0.0 : dt);
      ledger.tick(h_D, force);
      stored.push_back(law.storedEnergy((p_D - h_D).norm()));
    }
    const double slack = options.passivity.energy_J + (delay + 1) * options.max_force_N * ledger.longest() * (1 + 1e-9);
    EXPECT_GE(law.energy().least, -slack) << "round " << round;
    // In any interval: no more than the spring stored at its begin, plus the allowance.
    for (std::size_t begin = 0; begin < ledger.ticks(); begin += 7)
      for (std::size_t end = begin; end < ledger.ticks(); end += 5)
        ASSERT_LE(ledger.given(end) - ledger.given(begin),
                  stored[begin] + slack + options.passivity.power_W * dt * static_cast<double>(end - begin) + 1e-9)
            << "round " << round << " ticks " << begin << " to " << end;
  }
}

TEST(PassivityController, WithoutItTheBoundIsBroken) {
  // The same pump without the controller: shows that the test above can fail.
  ForceLaw off(lawWith(2000, 1, false)), on(lawWith(2000, 1, true));
  Ledger free(1), bounded(1);
  for (int tick = 0; tick < 4000; ++tick) {
    const Vector3d h_D(0.003 * std::sin(0.4 * tick), 0, 0);
    free.tick(h_D, off.apply(Vector3d::Zero(), h_D, Vector3d::Zero(), 1e-3));
    bounded.tick(h_D, on.apply(Vector3d::Zero(), h_D, Vector3d::Zero(), 1e-3));
  }
  EXPECT_GT(free.given(3999), 1.0);
  EXPECT_LT(off.energy().least, -1.0);
  EXPECT_LT(bounded.given(3999), 0.02);
  EXPECT_GT(on.energy().acted, 3000u);
  EXPECT_EQ(off.energy().acted, 0u);
}

TEST(PassivityController, LeavesAPassiveSpringAlone) {
  // A slow motion against the spring's own force: the spring returns the energy that it took.
  for (const bool on : {false, true}) {
    ForceLaw law(lawWith(200, 0, on));
    double largest_difference = 0;
    for (int tick = 0; tick < 20000; ++tick) {
      const double x = 0.005 * (1 - std::cos(2 * M_PI * tick / 10000.0));
      const Vector3d force = law.apply(Vector3d::Zero(), {x, 0, 0}, Vector3d::Zero(), 1e-3);
      largest_difference = std::max(largest_difference, std::abs(force.x() + 200 * x));
    }
    EXPECT_LT(largest_difference, 0.005) << on;  // of 2 N
    EXPECT_GT(law.energy().least, -5e-6);
  }
}

TEST(PassivityController, ObservesTheForceThatActed) {
  // One step of 1 mm against a force of 2 N, sent `delay` ticks before: exactly 2 mJ.
  for (const int delay : {0, 1, 2, 5}) {
    PassivityOptions options;
    options.delay_samples = delay;
    options.power_W = 0;
    PassivityController controller(options);
    controller.apply(Vector3d::Zero(), Vector3d::Zero(), 1.0, 1.0, 1e-3);
    controller.sent({2, 0, 0});
    for (int tick = 0; tick < delay; ++tick) {
      controller.apply(Vector3d::Zero(), Vector3d::Zero(), 1.0, 1.0, 1e-3);
      controller.sent(Vector3d::Zero());
    }
    EXPECT_EQ(controller.energy().observed, 1.0);
    controller.apply(Vector3d::Zero(), {0.001, 0, 0}, 1.0, 1.0, 1e-3);
    EXPECT_NEAR(controller.energy().observed, 1.0 - 0.002, 1e-15) << delay;
    controller.sent(Vector3d::Zero());
    controller.apply(Vector3d::Zero(), {0.002, 0, 0}, 1.0, 1.0, 1e-3);
    EXPECT_NEAR(controller.energy().observed, 1.0 - 0.002, 1e-15) << delay;
  }
}

TEST(PassivityController, CountsTheForceThatWasReallySent) {
  for (const int delay : {0, 1, 3}) {
    PassivityOptions options;
    options.delay_samples = delay;
    options.power_W = 0;
    PassivityController controller(options);
    const auto tick = [&](double x_m, double sent_N) {
      controller.apply(Vector3d::Zero(), {x_m, 0, 0}, 1.0, 1.0, 1e-3);
      controller.sent({sent_N, 0, 0});
    };
    // 2 N was commanded, but the device clamps at 0.5 N.
    tick(0, 2);
    controller.acted({0.5, 0, 0});
    for (int i = 0; i < delay; ++i) tick(0, 0.5);
    tick(0.001, 0.5);
    EXPECT_NEAR(controller.energy().observed, 1 - 0.0005, 1e-15) << delay;
  }
}

TEST(PassivityController, IfItIsUnknownWhichForceActedItCountsTheOneThatGivesMost) {
  PassivityOptions options;
  options.power_W = 0;
  options.delay_samples = 1;
  for (const bool taken : {false, true}) {
    for (const double way_m : {0.002, -0.002}) {
      PassivityController controller(options);
      const auto apply = [&](double x_m) { controller.apply(Vector3d::Zero(), {x_m, 0, 0}, 1.0, 1.0, 1e-3); };
      // 2 N acts, then it is taken away (or not) while the hand moves.
      apply(0);
      for (int i = 0; i < 4; ++i) {
        controller.sent({2, 0, 0});
        if (i == 3 && taken) controller.acted(Vector3d::Zero());
        apply(i == 3 ? way_m : 0);
      }
      const double given_J = !taken ? 2 * way_m : std::max(0.0, 2 * way_m);
      EXPECT_NEAR(controller.energy().observed, std::min(1.0, 1 - given_J), 1e-12);
    }
  }
  // The hand moves after equal states: 1 N or 3 N may have acted.
  PassivityController controller(options);
  controller.apply(Vector3d::Zero(), Vector3d::Zero(), 1.0, 1.0, 1e-3);
  for (const double sent_N : {1.0, 3.0, 2.0, 2.0}) {
    controller.sent({sent_N, 0, 0});
    controller.apply(Vector3d::Zero(), Vector3d::Zero(), 1.0, 1.0, 1e-3);
  }
  controller.sent({2, 0, 0});
  controller.apply(Vector3d::Zero(), {0.001, 0, 0}, 1.0, 1.0, 1e-3);
  EXPECT_NEAR(controller.energy().observed, 1 - 0.003, 1e-12);
}

TEST(PassivityController, DampsWhatOnePeriodTakesBackWithinItsCap) {
  PassivityOptions options;
  options.on = true;
  options.delay_samples = 0;
  options.power_W = 0;
  options.energy_J = 1e6;  // practically no weakening
  options.max_damping_Ns_m = 5;
  for (const double force : {0.001, 1.0}) {
    PassivityController controller(options);
    controller.apply(Vector3d::Zero(), Vector3d::Zero(), 0.0, 0.0, 1e-3);
    controller.sent({force, 0, 0});
    const Vector3d damped = controller.apply(Vector3d::Zero(), {1e-4, 0, 0}, 0.0, 0.0, 1e-3);
    const double deficit = force * 1e-4, speed = 0.1;
    const double wanted = deficit / (1e-3 * speed * speed);
    EXPECT_NEAR(damped.x(), -std::min(5.0, wanted) * speed, 1e-6);
  }
}

TEST(PassivityController, DissipatedEnergyIsNotSavedForLater) {
  PassivityOptions options;
  options.delay_samples = 0;
  PassivityController controller(options);
  controller.apply(Vector3d::Zero(), Vector3d::Zero(), 0.0, 0.0, 1e-3);
  controller.sent({-2, 0, 0});
  controller.apply(Vector3d::Zero(), {0.01, 0, 0}, 0.02, 0.0, 1e-3);  // the hand works 20 mJ into the spring
  EXPECT_NEAR(controller.energy().observed, 0.02, 1e-15);
  controller.sent(Vector3d::Zero());
  controller.apply(Vector3d::Zero(), {0.01, 0, 0}, 0.001, 0.02, 1e-3);  // the proxy found a nearer place
  EXPECT_NEAR(controller.energy().observed, 0.001, 1e-15);
  EXPECT_NEAR(controller.energy().injected, 0.02, 1e-15);  // by the first move, when the proxy stayed behind
}

TEST(PassivityController, WorkOfTheMovingWorkspaceIsNoDeficit) {
  // The world drifts at 0.1 m/s and takes the hand with it, under a constant pull of 1 N.
  ForceLawOptions options = lawWith(200, 1, true);
  ForceLaw law(options);
  Vector3d h_D(0.05, 0, 0), p_D(0.045, 0, 0);
  for (int tick = 0; tick < 300; ++tick) {
    const Vector3d force = law.apply(p_D, h_D, Vector3d::Zero(), 1e-3);
    ASSERT_NEAR(force.x(), -1, 1e-9);
    const Vector3d shift(1e-4, 0, 0);
    law.carried(shift);
    p_D -= shift;
    h_D -= shift;
  }
  EXPECT_EQ(law.energy().acted, 0u);
  EXPECT_NEAR(law.energy().injected, 0, 1e-12);
}

TEST(PassivityController, AWeakenedForceComesBackSlowly) {
  PassivityOptions options;
  options.on = true;
  options.delay_samples = 0;
  options.power_W = 1;
  options.recovery_1_s = 0.5;
  options.max_damping_Ns_m = 0;
  PassivityController controller(options);
  const Vector3d force(1, 0, 0);
  controller.apply(force, Vector3d::Zero(), 0.0, 0.0, 1e-3);
  controller.sent(force);
  EXPECT_NEAR(controller.apply(force, {0.0015, 0, 0}, 0.0, 0.0, 1e-3).x(), 0.5, 1e-12);  // 1.5 mJ given, 1 forgotten
  controller.sent(Vector3d::Zero());
  for (int tick = 1; tick <= 500; ++tick) {
    EXPECT_NEAR(controller.apply(force, {0.0015, 0, 0}, 0.0, 0.0, 1e-3).x(), 0.5 + 0.5e-3 * tick, 1e-9);
    controller.sent(Vector3d::Zero());
  }
  EXPECT_NEAR(controller.energy().weakest, 0.5, 1e-12);
  controller.restart();
  EXPECT_EQ(controller.apply(force, Vector3d::Zero(), 0.0, 0.0, 1e-3), force);
}

TEST(PassivityController, ACommandBringsItsEnergy) {
  // A command pulls the hand from 30 mm: the spring may give its stored 90 mJ.
  ForceLawOptions options = lawWith(200, 0, true);
  options.ramp_s = 0.5;
  ForceLaw law(options);
  Vector3d h_D(0.03, 0, 0);
  double largest = 0;
  for (int tick = 0; tick < 3000; ++tick) {
    const Vector3d force = law.apply(Vector3d::Zero(), h_D, Vector3d::Zero(), 1e-3);
    largest = std::max(largest, force.norm());
    h_D += force * 1e-4;  // a hand that only damps motion
  }
  EXPECT_GT(largest, 1);
  EXPECT_LT(h_D.norm(), 0.001);
}

TEST(PassivityController, RefusesOptionsOutOfRange) {
  const auto refuses = [](auto change) {
    PassivityOptions options;
    change(options);
    EXPECT_THROW(PassivityController{options}, UsageError);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double wrong : {nan, -1.0, std::numeric_limits<double>::infinity()}) {
    refuses([&](PassivityOptions& o) { o.energy_J = wrong; });
    refuses([&](PassivityOptions& o) { o.power_W = wrong; });
    refuses([&](PassivityOptions& o) { o.max_damping_Ns_m = wrong; });
  }
  refuses([](PassivityOptions& o) { o.energy_J = 0; });
  refuses([](PassivityOptions& o) { o.recovery_1_s = 0; });
  refuses([](PassivityOptions& o) { o.delay_samples = -1; });
  refuses([](PassivityOptions& o) { o.delay_samples = PassivityOptions::kMaxDelay + 1; });
}

}  // namespace
}  // namespace filiform
