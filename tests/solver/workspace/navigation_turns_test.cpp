// Navigation by devices that report rates, and by a stylus that turns.
#include "solver/workspace/navigation.h"
#include "tests/support/numbers.h"
#include "tests/support/scenes/navigation_scene.h"

#include <cmath>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using Eigen::Vector3d;
using test::forceOf;
using test::handAt;
using test::kDt_s;
using test::kInfinity;
using test::kNaN;
using Kind = NavigationCommand::Kind;
using Scene = test::NavigationScene;

DeviceState rates(const Vector3d& v_D, const Vector3d& twist_D = Vector3d::Zero()) {
  DeviceState state;
  state.v_D = v_D;
  state.twist_D = twist_D;
  state.status = DeviceStatus::ready;
  return state;
}

TEST(Navigation, RatesLeadTheProxyAndRestLeavesIt) {
  NavigationOptions options;
  options.rate_control = true;
  Scene scene(options, SolverMethod::climb);
  scene.command(Kind::jump, scene.somewhere());
  const Vector3d start_W = scene.navigation->tick(rates(Vector3d::Zero()), kDt_s).p_W;
  EXPECT_EQ(scene.navigation->tick(rates(Vector3d::Zero()), kDt_s).p_W, start_W);
  Vector3d p_W = start_W;
  double most_um = 0;
  for (int i = 0; i < 3000; ++i) {
    const NavigationTick& tick = scene.navigation->tick(rates({0.05, 0.02 * std::sin(i * 0.01), 0}), kDt_s);
    ASSERT_EQ(forceOf(tick), Vector3d::Zero()) << "no force may be commanded";
    ASSERT_LE((tick.h_D - tick.p_D).norm(), 0.02 + 1e-9);
    p_W = tick.p_W;
    most_um = std::max(most_um, (p_W - start_W).norm());
  }
  EXPECT_GT(most_um, 10) << "the proxy has travelled";
  const Vector3d left_W = scene.navigation->tick(rates(Vector3d::Zero()), kDt_s).p_W;
  for (int i = 0; i < 100; ++i) scene.navigation->tick(rates(Vector3d::Zero()), kDt_s);
  EXPECT_LT((scene.navigation->tick(rates(Vector3d::Zero()), kDt_s).p_W - left_W).norm(), 1e-6);
}

TEST(Navigation, ANeuriteThatEndsResistsTheRates) {
  NavigationOptions options;
  options.rate_control = true;
  Scene scene(options, SolverMethod::climb);
  scene.command(Kind::jump, scene.somewhere());
  EXPECT_EQ(scene.navigation->tick(rates(Vector3d::Zero()), kDt_s).wrench.resistance, 0);
  double most = 0, least_moving = 1;
  Vector3d p_W = scene.navigation->tick(rates(Vector3d::Zero()), kDt_s).p_W;
  for (int i = 0; i < 5000; ++i) {
    const NavigationTick& tick = scene.navigation->tick(rates({0.05, 0, 0}), kDt_s);
    ASSERT_GE(tick.wrench.resistance, 0);
    ASSERT_LE(tick.wrench.resistance, 1);
    if (tick.p_W != p_W) least_moving = std::min(least_moving, tick.wrench.resistance);
    p_W = tick.p_W;
    most = std::max(most, tick.wrench.resistance);
  }
  EXPECT_GT(most, 0.9) << "where the neurite leads no further";
  EXPECT_LT(least_moving, 0.5) << "less while the proxy follows";
  EXPECT_LT(scene.navigation->tick(rates(Vector3d::Zero()), kDt_s).wrench.resistance, 1e-9) << "at rest";
  scene.command(Kind::free, {});
  EXPECT_EQ(scene.navigation->tick(rates({0.05, 0, 0}), kDt_s).wrench.resistance, 0);
}

TEST(Navigation, TurnsOfTheDeviceRotateAboutTheProxyAndZoom) {
  for (const bool rate_control : {false, true}) {
    NavigationOptions options;
    options.rate_control = rate_control;
    Scene scene(options);
    scene.command(Kind::jump, scene.somewhere());
    scene.navigation->tick(rates(Vector3d::Zero()), kDt_s);
    const Eigen::Matrix3d before = scene.navigation->workspace().rotationMatrix();
    const double zoom_um = scene.navigation->workspace().zoom_um();
    const Vector3d p_D = scene.navigation->tick(rates(Vector3d::Zero(), {kNaN, 1, 0}), kDt_s).p_D;
    EXPECT_EQ(scene.navigation->workspace().rotationMatrix(), before);
    for (int i = 0; i < 500; ++i) {
      const NavigationTick& tick = scene.navigation->tick(rates(Vector3d::Zero(), {0, 1, -1}), kDt_s);
      ASSERT_LT((tick.p_D - p_D).norm(), 1e-9);
    }
    const Eigen::AngleAxisd turn(before.transpose() * scene.navigation->workspace().rotationMatrix());
    EXPECT_NEAR(turn.angle(), 0.5, 1e-9);
    EXPECT_NEAR(std::abs(turn.axis().y()), 1, 1e-9);
    EXPECT_NEAR(scene.navigation->workspace().zoom_um(), rate_control ? zoom_um * std::exp(-0.5) : zoom_um, 1e-6)
        << "a rolled stylus does not zoom";
  }
}

DeviceState stylusAt(const Eigen::Quaterniond& turn, std::uint32_t buttons) {
  DeviceState state = handAt(Vector3d::Zero(), buttons);
  state.orientation_D = turn;
  return state;
}

TEST(Navigation, TheStylusTurnsTheSceneAboutTheProxyWhileTheClutchIsHeld) {
  NavigationOptions options;
  options.buttons = {ButtonAction::none, ButtonAction::turn};
  options.has_stylus = true;
  Scene scene(options);
  scene.command(Kind::jump, scene.somewhere());
  Navigation& navigation = *scene.navigation;
  const auto about = [](const Vector3d& axis, double angle_rad) {
    return Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad, axis));
  };
  const Eigen::Matrix3d start = navigation.workspace().rotationMatrix();
  for (int i = 0; i < 100; ++i) navigation.tick(stylusAt(about(Vector3d::UnitX(), 0.005 * i), 1), kDt_s);
  EXPECT_EQ(navigation.workspace().rotationMatrix(), start) << "not without the clutch";
  const Vector3d p_D = navigation.tick(stylusAt(about(Vector3d::UnitX(), 0.5), 2), kDt_s).p_D;
  EXPECT_EQ(navigation.workspace().rotationMatrix(), start) << "not at the moment of the press";
  for (int i = 0; i <= 300; ++i) {
    // Two quaternions mean the same orientation.
    Eigen::Quaterniond turn = about(Vector3d::UnitX(), 0.5 + 0.001 * i);
    if (i % 2 == 0) turn.coeffs() = -turn.coeffs();
    const NavigationTick& tick = navigation.tick(stylusAt(turn, 2), kDt_s);
    ASSERT_LT((tick.p_D - p_D).norm(), 1e-9) << "rotation leaves the proxy where it is in the hand";
  }
  const Eigen::AngleAxisd turned(start.transpose() * navigation.workspace().rotationMatrix());
  EXPECT_NEAR(turned.angle(), 0.3, 1e-6);
  EXPECT_NEAR(std::abs(turned.axis().x()), 1, 1e-6);
  // As the same turn of a device that reports rates.
  Scene other;
  other.command(Kind::jump, other.somewhere());
  for (int i = 0; i <= 300; ++i) other.navigation->tick(rates(Vector3d::Zero(), {i == 0 ? 0.0 : 1.0, 0, 0}), kDt_s);
  EXPECT_LT((other.navigation->workspace().rotationMatrix() - navigation.workspace().rotationMatrix()).norm(), 1e-6);

  navigation.tick(stylusAt(about(Vector3d::UnitX(), 0.8), 2), kDt_s);
  const Eigen::Matrix3d held = navigation.workspace().rotationMatrix();
  for (int i = 0; i < 100; ++i) navigation.tick(stylusAt(about(Vector3d::UnitX(), 0.8), 2), kDt_s);
  EXPECT_EQ(navigation.workspace().rotationMatrix(), held) << "a stylus at rest";
  navigation.tick(stylusAt(about(Vector3d::UnitX(), 2.5), 2), kDt_s);
  EXPECT_EQ(navigation.workspace().rotationMatrix(), held) << "a jump of the sensor";
  for (const Eigen::Quaterniond& wrong :
       {Eigen::Quaterniond(0, 0, 0, 0), Eigen::Quaterniond(kNaN, 0, 0, 1), Eigen::Quaterniond(kInfinity, 0, 0, 0)}) {
    navigation.tick(stylusAt(wrong, 2), kDt_s);
    EXPECT_EQ(navigation.workspace().rotationMatrix(), held);
    NavigationSnapshot snapshot;
    navigation.fill(snapshot);
    EXPECT_TRUE(snapshot.has_stylus);
    EXPECT_TRUE(snapshot.stylus_D.coeffs().allFinite());
  }
}

// The one-button grip of the README: a click changes the mode; held, the wrist turns and its roll zooms.
TEST(Navigation, OneButtonTurnsZoomsAndChangesTheMode) {
  NavigationOptions options;
  options.buttons = {ButtonAction::mode_turn};
  Scene scene(options);
  scene.command(Kind::jump, scene.somewhere());
  Navigation& navigation = *scene.navigation;
  const auto hold = [&](std::uint32_t buttons, int ticks, const Vector3d& axis = Vector3d::UnitY()) {
    for (int i = 0; i < ticks; ++i)
      navigation.tick(stylusAt(Eigen::Quaterniond(Eigen::AngleAxisd(0.001 * i, axis)), buttons), kDt_s);
  };
  const auto turned = [&] { return Eigen::AngleAxisd(navigation.workspace().rotationMatrix()).angle(); };
  hold(1, 200);
  EXPECT_EQ(navigation.mode(), NavigationMode::constrained) << "not before it is released";
  hold(0, 50);
  EXPECT_EQ(navigation.mode(), NavigationMode::free) << "a click";
  EXPECT_EQ(turned(), 0);
  hold(1, 200);
  hold(0, 50);
  NavigationSnapshot snapshot;
  navigation.fill(snapshot);
  EXPECT_EQ(snapshot.asked_constrain, 1U);
  hold(1, 700);
  EXPECT_NEAR(turned(), 0.4, 0.01) << "held: from the end of a click's time on";
  EXPECT_NEAR(navigation.workspace().zoom_um(), 300, 1e-9);
  hold(0, 50);
  EXPECT_EQ(navigation.mode(), NavigationMode::free) << "the end of a turn is no click";
  const double angle = turned();
  hold(1, 1100, -Vector3d::UnitZ());
  EXPECT_NEAR(turned(), angle, 1e-9);
  EXPECT_NEAR(navigation.workspace().zoom_um(), 150, 3) << "0.8 rad clockwise: twice as near";
}

TEST(Navigation, AHeldZoomButtonZoomsOutAndAClickZoomsIn) {
  NavigationOptions options;
  options.buttons = {ButtonAction::zoom};
  Scene scene(options);
  const auto zoomAfter = [&](std::uint32_t buttons, int ticks) {
    for (int i = 0; i < ticks; ++i) scene.navigation->tick(handAt(Vector3d::Zero(), buttons), kDt_s);
    return scene.navigation->workspace().zoom_um();
  };
  EXPECT_EQ(zoomAfter(1, 250), 300);
  EXPECT_EQ(zoomAfter(0, 250), 150);
  EXPECT_EQ(zoomAfter(1, 300), 150);
  EXPECT_NEAR(zoomAfter(1, 1000), 600, 10) << "twice in 0.5 s";
  const double zoom_um = scene.navigation->workspace().zoom_um();
  EXPECT_EQ(zoomAfter(0, 100), zoom_um) << "no click";
}

TEST(Navigation, AButtonThatBouncesActsOnce) {
  Scene scene;
  scene.command(Kind::jump, scene.somewhere());
  const auto tick = [&](std::uint32_t buttons, int ticks) {
    for (int i = 0; i < ticks; ++i) scene.navigation->tick(handAt(Vector3d::Zero(), buttons), kDt_s);
  };
  for (const std::uint32_t buttons : {1, 0, 1, 0, 1}) tick(buttons, 1);
  tick(1, 100);
  for (const std::uint32_t buttons : {0, 1, 0}) tick(buttons, 1);
  tick(0, 100);
  NavigationSnapshot snapshot;
  scene.navigation->fill(snapshot);
  EXPECT_EQ(snapshot.mode, NavigationMode::free);
  EXPECT_EQ(snapshot.asked_constrain, 0U);
  tick(1, 1);
  scene.navigation->fill(snapshot);
  EXPECT_EQ(snapshot.asked_constrain, 1U) << "at once";
}

// While the hand carries the scene, no force acts, the proxy keeps its place, and the picture does not jump.
TEST(Navigation, ACarriedSceneFollowsTheHandWithoutForce) {
  for (const ButtonAction action : {ButtonAction::carry, ButtonAction::turn}) {
    NavigationOptions options;
    options.buttons = {ButtonAction::none, action};
    Scene scene(options);
    scene.command(Kind::jump, scene.somewhere());
    Navigation& navigation = *scene.navigation;
    const Vector3d pulled_D(0.004, 0.02, -0.003);
    NavigationTick last;
    for (int i = 0; i < 2000; ++i) last = navigation.tick(handAt(pulled_D, 0), kDt_s);
    const double pulled_N = last.wrench.force_N.norm();
    ASSERT_GT(pulled_N, 0.5);
    const ProxyPlace place = navigation.place();
    Vector3d h_D = pulled_D, p_D = last.p_D;
    for (int i = 0; i < 500; ++i) {
      h_D += Vector3d(4e-5, 0, 2e-5);
      const NavigationTick& tick = navigation.tick(handAt(h_D, 2), kDt_s);
      ASSERT_LT((tick.p_D - p_D).norm(), 1.2e-4 + 0.03 * (pulled_D - last.p_D).norm()) << i << ": no jump";
      ASSERT_LE(tick.wrench.force_N.norm(), pulled_N + 1e-9);
      if (i > 200) {
        ASSERT_EQ(tick.wrench.force_N.norm(), 0) << i;
      }
      ASSERT_FALSE(tick.solved);
      p_D = tick.p_D;
    }
    EXPECT_EQ(navigation.place().p_W, place.p_W);
    EXPECT_LT((p_D - h_D).norm(), 1e-4) << "the proxy lies at the hand";
    for (int i = 0; i < 1000; ++i)
      ASSERT_LT(navigation.tick(handAt(h_D, 0), kDt_s).wrench.force_N.norm(), 0.1) << "nothing pulls afterwards";
  }
}

}  // namespace
}  // namespace filiform
