#include "device/simulated/simulated_hand.h"

#include "tests/support/numbers.h"

#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using Eigen::Vector3d;
using test::kInfinity;
using test::kNaN;

SimulatedHandOptions hand(const std::string& name, int delay_samples = 0) {
  SimulatedHandOptions options;
  options.hand = handParameters(name);
  options.delay_samples = delay_samples;
  return options;
}

Wrench force(const Vector3d& force_N) {
  Wrench wrench;
  wrench.force_N = force_N;
  return wrench;
}

// Position of m x'' = -k (x - 1) - c x' from rest at 0: the textbook step response.
double stepResponse(double m, double c, double k, double t) {
  const double w = std::sqrt(k / m);
  const double z = c / (2 * std::sqrt(k * m));
  if (std::abs(z - 1) < 1e-12) return 1 - std::exp(-w * t) * (1 + w * t);
  if (z < 1) {
    const double wd = w * std::sqrt(1 - z * z);
    return 1 - std::exp(-z * w * t) * (std::cos(wd * t) + z * w / wd * std::sin(wd * t));
  }
  const double root = w * std::sqrt(z * z - 1);
  const double a = -z * w + root;
  const double b = -z * w - root;
  return 1 - (b * std::exp(a * t) - a * std::exp(b * t)) / (b - a);
}

TEST(SimulatedHand, FollowsTheAnalyticStepResponse) {
  struct Case {
    double mass_kg, damping_Ns_m, stiffness_N_m, period_s;
  };
  // Loose, medium, firm; critically damped, overdamped, undamped, stiff; and slow loops.
  for (const Case& c : {Case{0.10, 2.5, 30, 0.001}, Case{0.15, 5.5, 200, 0.001}, Case{0.30, 12.5, 600, 0.001},
                        Case{1, 20, 100, 0.001}, Case{0.1, 60, 100, 0.001}, Case{0.2, 0, 300, 0.001},
                        Case{0.001, 1, 1e6, 0.001}, Case{0.15, 5.5, 200, 0.1}, Case{0.15, 5.5, 200, 1e-6}}) {
    SimulatedHandOptions options;
    options.hand = {c.mass_kg, c.damping_Ns_m, c.stiffness_N_m};
    options.device_damping_Ns_m = 0;
    options.period_s = c.period_s;
    SimulatedHand device(options);
    device.open();
    const Vector3d step_D(0.03, -0.02, 0.01);
    device.setTarget(step_D);
    double worst = 0;
    for (int i = 1; i <= 2000; ++i) {
      const DeviceState state = device.exchange({});
      const double expected = stepResponse(c.mass_kg, c.damping_Ns_m, c.stiffness_N_m, i * c.period_s);
      worst = std::max(worst, (state.p_D - expected * step_D).cwiseAbs().maxCoeff());
      ASSERT_DOUBLE_EQ(state.time_s, i * c.period_s);
    }
    EXPECT_LT(worst, 1e-11) << "metres; mass " << c.mass_kg << ", damping " << c.damping_Ns_m << ", stiffness "
                            << c.stiffness_N_m << ", period " << c.period_s;
  }
}

TEST(SimulatedHand, VelocityIsTheDerivativeOfPosition) {
  SimulatedHandOptions options = hand("medium");
  options.period_s = 1e-5;
  SimulatedHand device(options);
  device.open();
  device.setTarget({0.03, 0, -0.02});
  Vector3d before_D = device.exchange({}).p_D;
  DeviceState middle = device.exchange({});
  for (int i = 0; i < 5000; ++i) {
    const DeviceState after = device.exchange({});
    ASSERT_LT((middle.v_D - (after.p_D - before_D) / 2e-5).norm(), 1e-6);
    before_D = middle.p_D;
    middle = after;
  }
}

TEST(SimulatedHand, AForceMovesItByForceOverStiffness) {
  for (const char* name : {"loose", "medium", "firm"}) {
    SimulatedHand device(hand(name));
    device.open();
    const Vector3d force_N(0.5, -0.25, 1);
    DeviceState state;
    for (int i = 0; i < 5000; ++i) state = device.exchange(force(force_N));
    EXPECT_LT((state.p_D - force_N / handParameters(name).stiffness_N_m).norm(), 1e-9) << name;
    EXPECT_LT(state.v_D.norm(), 1e-8) << name;
  }
}

TEST(SimulatedHand, AWrenchActsAsManyPeriodsLateAsStated) {
  for (int delay = 0; delay <= 2; ++delay) {
    SimulatedHand device(hand("medium", delay));
    device.open();
    EXPECT_EQ(device.capabilities().delay_samples, delay);
    device.exchange({});
    device.exchange(force({1, 0, 0}));  // one pulse
    int periods_until_motion = 0;
    // Without delay, the exchange with the pulse has already moved the hand.
    SimulatedHand twin(hand("medium", delay));
    twin.open();
    twin.exchange({});
    DeviceState state = twin.exchange(force({1, 0, 0}));
    while (state.p_D.x() == 0 && periods_until_motion < 5) {
      state = twin.exchange({});
      ++periods_until_motion;
    }
    EXPECT_EQ(periods_until_motion, delay);
  }
}

TEST(SimulatedHand, RepeatsItselfBitForBit) {
  const auto run = [] {
    SimulatedHand device(hand("firm", 2));
    device.open();
    std::vector<double> out;
    for (int i = 0; i < 3000; ++i) {
      device.setTarget({0.01 * std::sin(0.01 * i), 0.02, 0.03 * std::cos(0.003 * i)});
      const DeviceState s = device.exchange(force({std::sin(0.05 * i), 0.3, -0.1}));
      out.insert(out.end(), {s.p_D.x(), s.p_D.y(), s.p_D.z(), s.v_D.x(), s.v_D.y(), s.v_D.z(), s.time_s});
    }
    return out;
  };
  EXPECT_EQ(run(), run());
}

// The largest eigenvalue of the sampled loop decides; energy after five seconds shows its sign.
double amplitudeAfterFiveSeconds(const SimulatedHandOptions& options, double wall_N_m) {
  SimulatedHand device(options);
  device.open();
  device.setTarget({0.001, 0, 0});
  for (int i = 0; i < 100; ++i) device.exchange({});
  device.setTarget(Vector3d::Zero());
  DeviceState state = device.exchange({});
  double last_second_m = 0;
  for (int i = 0; i < 5000; ++i) {
    state = device.exchange(force(-wall_N_m * state.p_D));
    if (i >= 4000) last_second_m = std::max(last_second_m, state.p_D.norm());
  }
  return last_second_m;
}

TEST(SimulatedHand, AWallIsStableUpToThePredictedStiffnessAndNotFarBeyond) {
  for (const char* name : {"loose", "medium", "firm"}) {
    for (int delay = 0; delay <= 2; ++delay) {
      SimulatedHandOptions options = hand(name, delay);
      options.peak_force_N = 1e9;
      const double damping_Ns_m = options.hand.damping_Ns_m + options.device_damping_Ns_m;
      const double bound_N_m = damping_Ns_m / (options.period_s / 2 + delay * options.period_s);
      EXPECT_LT(amplitudeAfterFiveSeconds(options, 0.9 * bound_N_m), 1e-5) << name << ", delay " << delay;
      EXPECT_GT(amplitudeAfterFiveSeconds(options, 1.3 * bound_N_m), 1e-2) << name << ", delay " << delay;
    }
  }
}

TEST(SimulatedHand, AForceThatIsNotFiniteIsNone) {
  SimulatedHand pushed(hand("medium"));
  SimulatedHand left_alone(hand("medium"));
  pushed.open();
  left_alone.open();
  for (const Vector3d& bad : {Vector3d(kNaN, 1, 0), Vector3d(0, kInfinity, 0), Vector3d(1, 1, -kInfinity)}) {
    pushed.setTarget({0.01, 0, 0});
    left_alone.setTarget({0.01, 0, 0});
    EXPECT_EQ(pushed.exchange(force(bad)).p_D, left_alone.exchange({}).p_D);
  }
  Wrench bad_torque = force({1, 0, 0});
  bad_torque.torque_Nm.z() = kNaN;
  EXPECT_EQ(pushed.exchange(bad_torque).p_D, left_alone.exchange({}).p_D);
}

TEST(SimulatedHand, AHugeForceSaturatesAndKeepsItsDirection) {
  SimulatedHand huge(hand("medium"));
  SimulatedHand peak(hand("medium"));
  huge.open();
  peak.open();
  const Vector3d direction = Vector3d(1, -2, 2) / 3;
  for (int i = 0; i < 100; ++i) {
    const Vector3d p_D = huge.exchange(force(1e300 * direction)).p_D;
    EXPECT_LT((p_D - peak.exchange(force(20 * direction)).p_D).norm(), 1e-12);
  }
  EXPECT_TRUE(huge.exchange(force(Vector3d::Constant(std::numeric_limits<double>::max()))).p_D.allFinite());
}

TEST(SimulatedHand, ATargetOutOfReachIsIgnored) {
  SimulatedHand device(hand("medium"));
  device.open();
  for (const Vector3d& bad : {Vector3d(kNaN, 0, 0), Vector3d(0, kInfinity, 0), Vector3d(0, 0, 10.5)}) {
    device.setTarget(bad);
    EXPECT_EQ(device.exchange({}).p_D, Vector3d::Zero());
    device.reset(bad);
    EXPECT_EQ(device.exchange({}).p_D, Vector3d::Zero());
  }
}

TEST(SimulatedHand, ResetPutsItAtRestAndTimeGoesOn) {
  SimulatedHand device(hand("loose", 2));
  device.open();
  device.setTarget({0.05, 0, 0});
  for (int i = 0; i < 50; ++i) device.exchange(force({2, 2, 2}));
  device.reset({0.02, -0.01, 0});
  const DeviceState state = device.exchange({});
  EXPECT_LT((state.p_D - Vector3d(0.02, -0.01, 0)).norm(), 1e-15);
  EXPECT_LT(state.v_D.norm(), 1e-12);
  EXPECT_DOUBLE_EQ(state.time_s, 0.051);
}

TEST(SimulatedHand, MovesOnlyWhileReady) {
  SimulatedHand device(hand("medium"));
  EXPECT_EQ(device.status(), DeviceStatus::closed);
  device.setTarget({0.01, 0, 0});
  DeviceState state = device.exchange(force({1, 0, 0}));
  EXPECT_EQ(state.status, DeviceStatus::closed);
  EXPECT_EQ(state.p_D, Vector3d::Zero());
  EXPECT_EQ(state.time_s, 0);

  device.open();
  EXPECT_EQ(device.status(), DeviceStatus::ready);
  state = device.exchange(force({1, 0, 0}));
  EXPECT_EQ(state.status, DeviceStatus::ready);
  EXPECT_GT(state.p_D.x(), 0);

  device.injectFault();
  const DeviceState lost = device.exchange(force({1, 0, 0}));
  EXPECT_EQ(lost.status, DeviceStatus::fault);
  EXPECT_EQ(lost.p_D, state.p_D);
  EXPECT_EQ(lost.time_s, state.time_s);

  device.close();
  device.close();
  EXPECT_EQ(device.exchange({}).status, DeviceStatus::closed);
  device.injectFault();
  EXPECT_EQ(device.status(), DeviceStatus::closed);

  device.open();
  EXPECT_EQ(device.exchange({}).p_D, Vector3d::Zero()) << "opening starts afresh";
}

TEST(SimulatedHand, RefusesWhatIsNoHand) {
  const auto refuses = [](auto change) {
    SimulatedHandOptions options;
    change(options);
    EXPECT_THROW(SimulatedHand{options}, DeviceError);
  };
  refuses([](auto& o) { o.hand.mass_kg = 0; });
  refuses([](auto& o) { o.hand.mass_kg = kNaN; });
  refuses([](auto& o) { o.hand.damping_Ns_m = -1; });
  refuses([](auto& o) { o.hand.stiffness_N_m = kInfinity; });
  refuses([](auto& o) { o.period_s = 0; });
  refuses([](auto& o) { o.delay_samples = 3; });
  refuses([](auto& o) { o.delay_samples = -1; });
  refuses([](auto& o) { o.device_damping_Ns_m = kNaN; });
  refuses([](auto& o) { o.peak_force_N = -1; });
  refuses([](auto& o) { o.start_D.x() = kNaN; });
  EXPECT_THROW(handParameters("iron"), DeviceError);
}

}  // namespace
}  // namespace filiform
