#include "solver/workspace/navigation.h"

#include "index/errors.h"
#include "tests/support/no_alloc_guard.h"
#include "tests/support/numbers.h"
#include "tests/support/scenes/navigation_scene.h"

#include <cmath>
#include <memory>
#include <random>

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

TEST(Navigation, WithoutAPlaceThereIsNoForce) {
  Scene scene;
  const NavigationTick& tick = scene.navigation->tick(handAt({0.01, 0, 0}), kDt_s);
  EXPECT_FALSE(tick.solved);
  EXPECT_TRUE(forceOf(tick).isZero(0));
}

TEST(Navigation, JumpPutsThePlaceUnderTheHandWithoutAPull) {
  Scene scene;
  const Vector3d h_D(0.01, -0.02, 0.03);
  for (const std::uint32_t number : {0u, 100u, 500u}) {
    const ProxyPlace place = scene.somewhere(number);
    ASSERT_TRUE(scene.command(Kind::jump, place, h_D));
    const NavigationTick& tick = scene.navigation->tick(handAt(h_D), kDt_s);
    EXPECT_LT((tick.h_W - place.p_W).norm(), 1e-9);
    EXPECT_LT((tick.p_W - place.p_W).norm(), 1e-9);
    EXPECT_LT(forceOf(tick).norm(), 1e-9);
  }
}

TEST(Navigation, AJumpWithAReachThatMakesNoSenseIsRefused) {
  Scene scene({}, SolverMethod::force);
  NavigationCommand jump;
  jump.kind = Kind::jump;
  jump.place = scene.somewhere();
  for (const double bad : {-1.0, kNaN, std::numeric_limits<double>::infinity()}) {
    jump.reach = {1, bad};
    EXPECT_FALSE(scene.navigation->apply(jump, Vector3d::Zero()));
    jump.reach = {bad, 1};
    EXPECT_FALSE(scene.navigation->apply(jump, Vector3d::Zero()));
  }
  EXPECT_FALSE(scene.navigation->place().valid());
  jump.reach = {0, 1};
  EXPECT_TRUE(scene.navigation->apply(jump, Vector3d::Zero()));
}

TEST(Navigation, ConstrainLeavesTheWorkspaceAndDrawsTheHandOverTheRamp) {
  Scene scene;
  const ProxyPlace place = scene.somewhere();
  ASSERT_TRUE(scene.command(Kind::jump, place));
  ASSERT_TRUE(scene.command(Kind::free));
  const Vector3d h_D(0.03, 0.03, 0.03);
  const Vector3d h_W = scene.navigation->tick(handAt(h_D), kDt_s).h_W;
  ASSERT_TRUE(scene.command(Kind::constrain, place, h_D));
  EXPECT_EQ(scene.navigation->workspace().toWorld(h_D), h_W);
  double last = 0;
  for (int tick = 0; tick < 700; ++tick) {
    const double force = forceOf(scene.navigation->tick(handAt(h_D), kDt_s)).norm();
    EXPECT_LE(force, last + (100 + 8 / 0.5) * kDt_s + 1e-9);
    last = force;
  }
  EXPECT_GT(last, 0.1);
}

TEST(Navigation, ForceIsTheSpringBetweenProxyAndProbe) {
  NavigationOptions options;
  options.force.ramp_s = 0;
  Scene scene(options);
  ASSERT_TRUE(scene.command(Kind::jump, scene.somewhere()));
  const Vector3d h_D(0.004, 0.003, -0.002);
  for (int tick = 0; tick < 100; ++tick) scene.navigation->tick(handAt(h_D), kDt_s);
  const NavigationTick& tick = scene.navigation->tick(handAt(h_D), kDt_s);
  EXPECT_LT((forceOf(tick) - 200 * (tick.p_D - h_D)).norm(), 1e-9);
  EXPECT_LT((scene.navigation->workspace().toWorld(h_D) - tick.h_W).norm(), 1e-9);
  EXPECT_LE((tick.p_W - tick.h_W).norm(), (scene.somewhere().p_W - tick.h_W).norm() + 1e-9);
}

TEST(Navigation, ZoomAndRotationLeaveTheForceUntilTheProxyMoves) {
  NavigationOptions options;
  options.force.ramp_s = 0;
  Scene scene(options);
  ASSERT_TRUE(scene.command(Kind::jump, scene.somewhere(50)));
  const Vector3d h_D(0.004, 0.003, -0.002);
  for (int tick = 0; tick < 100; ++tick) scene.navigation->tick(handAt(h_D), kDt_s);
  const Vector3d p_D = scene.navigation->workspace().toDevice(scene.navigation->place().p_W);
  NavigationCommand command;
  command.kind = Kind::zoom;
  command.factor = 0.1;
  ASSERT_TRUE(scene.navigation->apply(command, h_D));
  command.kind = Kind::rotate;
  command.about_x_rad = 0.3;
  command.about_y_rad = -0.2;
  ASSERT_TRUE(scene.navigation->apply(command, h_D));
  EXPECT_LT((scene.navigation->workspace().toDevice(scene.navigation->place().p_W) - p_D).norm(), 1e-12);
}

TEST(Navigation, FreeModeFollowsTheProbeWithoutForce) {
  Scene scene;
  ASSERT_TRUE(scene.command(Kind::jump, scene.somewhere()));
  ASSERT_TRUE(scene.command(Kind::free));
  for (int i = 0; i < 50; ++i) {
    const NavigationTick& tick = scene.navigation->tick(handAt({0.001 * i, 0.01, 0}), kDt_s);
    EXPECT_TRUE(forceOf(tick).isZero(0));
    EXPECT_EQ(tick.p_W, tick.h_W);
    EXPECT_FALSE(tick.solved);
  }
  // At the edge of the box, the workspace moves with the probe: the user can go anywhere.
  const Vector3d before_W = scene.navigation->workspace().centre_W();
  for (int i = 0; i < 500; ++i) scene.navigation->tick(handAt({0.058, 0, 0}), kDt_s);
  EXPECT_GT((scene.navigation->workspace().centre_W() - before_W).x(), 10);
}

TEST(Navigation, ButtonsDoWhatTheTableSays) {
  Scene scene;
  ASSERT_TRUE(scene.command(Kind::jump, scene.somewhere()));
  Navigation& navigation = *scene.navigation;
  navigation.tick(handAt(Vector3d::Zero(), 0b0100), kDt_s);  // zoom in
  EXPECT_NEAR(navigation.workspace().zoom_um(), 150, 1e-9);
  navigation.tick(handAt(Vector3d::Zero(), 0b0100), kDt_s);  // a held button acts once
  EXPECT_NEAR(navigation.workspace().zoom_um(), 150, 1e-9);
  navigation.tick(handAt(Vector3d::Zero(), 0b1000), kDt_s);  // zoom out
  EXPECT_NEAR(navigation.workspace().zoom_um(), 300, 1e-9);
  navigation.tick(handAt(Vector3d::Zero(), 0b0001), kDt_s);
  EXPECT_EQ(navigation.mode(), NavigationMode::free);
  for (int i = 0; i < 50; ++i) navigation.tick(handAt(Vector3d::Zero(), 0), kDt_s);
  NavigationSnapshot snapshot;
  navigation.fill(snapshot);
  EXPECT_EQ(snapshot.asked_constrain, 0u);
  navigation.tick(handAt(Vector3d::Zero(), 0b0001), kDt_s);
  navigation.fill(snapshot);
  EXPECT_EQ(snapshot.asked_constrain, 1u);  // the commanding thread finds the nearest segment
  EXPECT_EQ(navigation.mode(), NavigationMode::free);
}

TEST(Navigation, AJumpWithoutAFiniteHandPositionMovesNothing) {
  Scene scene;
  const ProxyPlace before = scene.somewhere(0);
  ASSERT_TRUE(scene.command(Kind::jump, before, {0.01, 0, 0}));
  for (const double bad : {kNaN, kInfinity}) {
    EXPECT_FALSE(scene.command(Kind::jump, scene.somewhere(100), {0, bad, 0}));
    EXPECT_EQ(scene.navigation->place().p_W, before.p_W);
    EXPECT_LT((scene.navigation->workspace().toDevice(before.p_W) - Vector3d(0.01, 0, 0)).norm(), 1e-9);
  }
  EXPECT_TRUE(scene.command(Kind::constrain, scene.somewhere(100), {0, kNaN, 0}))
      << "constrain does not need the hand's position";
}

// Jumps within a cell and to another cell, and free mode and back, by command and by button. Each while the hand is
// pulled.
TEST(Navigation, NoCommandStepsTheForceBeyondTheSlewLimit) {
  for (const SolverMethod method : kSolverMethods) {
    SCOPED_TRACE(toString(method));
    Scene scene({}, method);
    const ForceLawOptions law;
    std::mt19937_64 random(3);
    ASSERT_TRUE(scene.command(Kind::jump, scene.somewhere(20)));
    Vector3d last_N = Vector3d::Zero(), last_D = Vector3d::Zero(), last_anchor_D = Vector3d::Zero();
    int since = 1000, pulled = 0, refused = 0;
    std::uint32_t buttons = 0;
    for (int i = 0; i < 30000; ++i) {
      const double s = 1e-3 * i;
      const Vector3d h_D = 0.02 * Vector3d(std::sin(2 * s), std::sin(3.1 * s), std::sin(1.3 * s));
      buttons = 0;
      if (i % 400 == 399) {
        since = 0;
        pulled += last_N.norm() > 0.3;
        const int kind = i / 400 % 5;
        const auto place = scene.somewhere(static_cast<std::uint32_t>(random() % 1000));
        if (kind == 0) refused += !scene.command(Kind::jump, place, h_D);
        if (kind == 1) refused += !scene.command(Kind::constrain, place, h_D);
        if (kind == 2) refused += !scene.command(Kind::free);
        if (kind == 3) refused += !scene.command(Kind::constrain, place, h_D);
        if (kind == 4) buttons = 1;  // switches to free mode
      }
      const NavigationTick& tick = scene.navigation->tick(handAt(h_D, buttons), kDt_s);
      // In addition, the spring may change by the hand's own step, and by the step of proxy or anchor during the ramp.
      const double stretched_N = 200 * ((h_D - last_D).norm() + (tick.anchor_D - last_anchor_D).norm());
      const double most_N = (law.max_slew_N_s + law.max_force_N / law.ramp_s) * kDt_s;
      if (since < 60) {
        ASSERT_LE((forceOf(tick) - last_N).norm(), most_N + (since == 0 ? 0.0 : stretched_N) + 1e-9)
            << i << ", " << since << " ticks after the command";
      }
      ++since;
      last_N = forceOf(tick);
      last_D = h_D;
      last_anchor_D = tick.anchor_D;
    }
    EXPECT_EQ(refused, 0);
    EXPECT_GT(pulled, 10);
  }
}

TEST(Navigation, DriftChangesTheForceByNoMoreThanStated) {
  for (const double stiffness : {50.0, 200.0, 5000.0}) {
    NavigationOptions options;
    options.force.stiffness_N_m = stiffness;
    options.force.ramp_s = 0;
    options.force.max_force_N = 1e6;
    options.force.max_slew_N_s = 1e9;
    Scene scene(options);
    const ProxyPlace place = scene.somewhere();
    // The hand is at the edge of the box and the proxy rests: the workspace drifts under both.
    ASSERT_TRUE(scene.command(Kind::jump, place, {0.055, 0, 0}));
    Workspace workspace = scene.navigation->workspace();
    const Vector3d before = stiffness * (workspace.toDevice(place.p_W) - Vector3d(0.055, 0, 0));
    const Vector3d shift = workspace.drift(place.p_W, kDt_s);
    const Vector3d after = stiffness * (workspace.toDevice(place.p_W) - Vector3d(0.055, 0, 0));
    EXPECT_GT(shift.norm(), 0);
    EXPECT_LE((after - before).norm(), options.drift_force_N_s * kDt_s * (1 + 1e-9));
  }
}

TEST(Navigation, ImpossibleCommandsAreRefusedAndCounted) {
  Scene scene;
  NavigationCommand command;
  command.kind = Kind::jump;
  EXPECT_FALSE(scene.navigation->apply(command, Vector3d::Zero()));
  command.place = scene.somewhere();
  command.place.p_W.x() = kNaN;
  EXPECT_FALSE(scene.navigation->apply(command, Vector3d::Zero()));
  command.kind = Kind::zoom;
  for (const double factor : {0.0, -1.0, kNaN, kInfinity}) {
    command.factor = factor;
    EXPECT_FALSE(scene.navigation->apply(command, Vector3d::Zero()));
  }
  command.kind = Kind::leap;
  command.factor = 0.3;
  EXPECT_TRUE(scene.navigation->apply(command, Vector3d::Zero()));
  for (const double factor : {-0.1, 1.1, kNaN}) {
    command.factor = factor;
    EXPECT_FALSE(scene.navigation->apply(command, Vector3d::Zero()));
  }
  command.kind = Kind::rotate;
  command.about_x_rad = kNaN;
  EXPECT_FALSE(scene.navigation->apply(command, Vector3d::Zero()));
  NavigationSnapshot snapshot;
  scene.navigation->fill(snapshot);
  EXPECT_EQ(snapshot.commands_refused, 10u);
  EXPECT_EQ(snapshot.leap, 0.3);
  EXPECT_FALSE(snapshot.place.valid());
}

TEST(Navigation, DeviceThatIsNotReadyGetsNoForceAndTheRampRestarts) {
  Scene scene;
  ASSERT_TRUE(scene.command(Kind::jump, scene.somewhere()));
  const Vector3d h_D(0.01, 0.01, 0.01);
  for (int i = 0; i < 600; ++i) scene.navigation->tick(handAt(h_D), kDt_s);
  ASSERT_GT(forceOf(scene.navigation->tick(handAt(h_D), kDt_s)).norm(), 0.01);
  DeviceState away = handAt({5, 5, 5});
  away.status = DeviceStatus::homing;
  const ProxyPlace place = scene.navigation->place();
  EXPECT_TRUE(forceOf(scene.navigation->tick(away, kDt_s)).isZero(0));
  EXPECT_EQ(scene.navigation->place().p_W, place.p_W);
  EXPECT_TRUE(forceOf(scene.navigation->tick(handAt(h_D), kDt_s)).isZero(0));
  EXPECT_GT(forceOf(scene.navigation->tick(handAt(h_D), kDt_s)).norm(), 0);
}

// Ticks with missing tiles are undone and repeated with the tiles. They must equal ticks that had all tiles.
TEST(Navigation, UndoneAndRepeatedTickIsTheTickWithAllTiles) {
  constexpr std::uint64_t kSeed = 5;
  SCOPED_TRACE(kSeed);
  for (const SolverMethod method : kSolverMethods) {
    Scene whole({}, method, 8), part({}, method, 8);
    std::mt19937_64 random(kSeed);
    const ProxyPlace start = whole.somewhere(20);
    ASSERT_TRUE(whole.command(Kind::jump, start));
    for (TileId id = 0; id < part.store->tile_count(); ++id) part.table.retire(id);
    part.table.add(*part.held[start.tile]);
    ASSERT_TRUE(part.command(Kind::jump, start));
    std::uniform_real_distribution<double> step(-1, 1);
    Vector3d h_D = Vector3d::Zero(), v_D = Vector3d::Zero();
    int undone = 0, frontiers = 0;
    for (int i = 0; i < 6000; ++i) {
      v_D = 0.995 * v_D + 2e-5 * Vector3d(step(random), step(random), step(random)) - 1e-4 * h_D;
      h_D += v_D;
      const std::uint32_t buttons = i % 1000 == 500 ? (i % 2000 == 500 ? 0b0100 : 0b1000) : 0;
      const NavigationTick expected = whole.navigation->tick(handAt(h_D, buttons), kDt_s);
      const NavigationTick* tick = &part.navigation->tick(handAt(h_D, buttons), kDt_s);
      for (int repeats = 0; tick->frontier; ++repeats) {
        ASSERT_LT(repeats, 400);
        ++frontiers;
        const Vector3d resting_D = tick->p_D;
        ASSERT_TRUE(resting_D.allFinite());
        ASSERT_TRUE(forceOf(*tick).allFinite());
        part.navigation->undoSolve();
        for (std::uint32_t a = 0; a < tick->step.absent.count; ++a)
          part.table.add(*part.held[tick->step.absent.ids[a]]);
        tick = &part.navigation->tick(handAt(h_D, buttons), kDt_s);
        ++undone;
      }
      ASSERT_EQ(tick->p_W, expected.p_W) << "tick " << i;
      ASSERT_EQ(tick->h_W, expected.h_W);
      ASSERT_EQ(forceOf(*tick), forceOf(expected));
      ASSERT_EQ(part.navigation->place().segment, whole.navigation->place().segment);
      ASSERT_EQ(part.navigation->ticks(), whole.navigation->ticks());
      ASSERT_EQ(part.navigation->workspace().centre_W(), whole.navigation->workspace().centre_W());
      // Tiles are retired now and then, so that frontiers occur again.
      if (i % 300 == 299)
        for (TileId id = 0; id < part.store->tile_count(); ++id)
          if (id != part.navigation->place().tile && id != part.store->long_tile()) part.table.retire(id);
    }
    EXPECT_GT(undone, 5);
    EXPECT_GT(frontiers, 5);
  }
}

TEST(Navigation, AtAFrontierTheForceStaysBoundedAndContinuous) {
  NavigationOptions options;
  options.force.ramp_s = 0;
  Scene scene(options, SolverMethod::force, 8);
  const ProxyPlace start = scene.somewhere(20);
  for (TileId id = 0; id < scene.store->tile_count(); ++id) scene.table.retire(id);
  scene.table.add(*scene.held[start.tile]);
  ASSERT_TRUE(scene.command(Kind::jump, start));
  Vector3d last = Vector3d::Zero(), last_D = Vector3d::Zero();
  int frontiers = 0;
  for (int i = 0; i < 4000; ++i) {
    const double s = 5e-5 * i;
    const NavigationTick& tick = scene.navigation->tick(
        handAt({0.04 * std::sin(s * 30), 0.04 * std::sin(s * 17), 0.04 * std::sin(s * 7)}), kDt_s);
    frontiers += tick.frontier;
    ASSERT_LE(forceOf(tick).norm(), 8 * (1 + 1e-12));
    ASSERT_LE(forceOf(tick).norm(), last.norm() + 100 * kDt_s + 200 * (tick.h_D - last_D).norm() + 1e-9);
    last = forceOf(tick);
    last_D = tick.h_D;
  }
  EXPECT_GT(frontiers, 100);
}

TEST(Navigation, ExtremesGiveFiniteBoundedForces) {
  constexpr std::uint64_t kSeed = 9;
  SCOPED_TRACE(kSeed);
  std::mt19937_64 random(kSeed);
  const auto logUniform = [&](double lo, double hi) {
    return std::exp(std::uniform_real_distribution<double>(std::log(lo), std::log(hi))(random));
  };
  for (int round = 0; round < 40; ++round) {
    NavigationOptions options;
    options.force.stiffness_N_m = logUniform(1e-3, 1e6);
    options.workspace.zoom_um = logUniform(1e-6, 1e6);
    options.force.ramp_s = round % 2 ? 0.0 : 0.1;
    Scene scene(options, kSolverMethods[round % 4]);
    const double dt_s = logUniform(1e-6, 1);
    ASSERT_TRUE(scene.command(Kind::jump, scene.somewhere(static_cast<std::uint32_t>(round))));
    for (int i = 0; i < 200; ++i) {
      Vector3d h_D(logUniform(1e-6, 1), -logUniform(1e-6, 1), logUniform(1e-6, 1));
      if (i % 17 == 3) h_D[i % 3] = kNaN;
      if (i % 17 == 8) h_D[i % 3] = i % 2 ? kInfinity : -kInfinity;
      if (i % 17 == 12) h_D *= 1e300;
      const NavigationTick& tick = scene.navigation->tick(handAt(h_D), dt_s);
      ASSERT_TRUE(forceOf(tick).allFinite());
      ASSERT_LE(forceOf(tick).norm(), 8 * (1 + 1e-12));
      ASSERT_TRUE(tick.p_W.allFinite());
    }
    EXPECT_GT(scene.navigation->force_law().events().not_finite, 0u);
  }
}

TEST(Navigation, TickNeitherAllocatesNorLocksNorCallsTheSystem) {
  for (const SolverMethod method : kSolverMethods) {
    Scene scene({}, method, 8);
    ASSERT_TRUE(scene.command(Kind::jump, scene.somewhere(20)));
    NavigationLink link;
    NavigationCommand command;
    command.kind = Kind::rotate;
    command.about_x_rad = 0.01;
    ASSERT_TRUE(link.commands.push(command));
    NavigationSnapshot snapshot;
    std::uint64_t visited = 0;
    test::NoAllocGuard guard;
    for (int i = 0; i < 3000; ++i) {
      if (i % 500 == 0) scene.table.retire(scene.navigation->place().tile ^ 1u);
      while (link.commands.pop(command)) scene.navigation->apply(command, Vector3d::Zero());
      const double s = 1e-3 * i;
      const NavigationTick& tick = scene.navigation->tick(
          handAt({0.05 * std::sin(s * 3), 0.05 * std::sin(s * 1.7), 0.05 * std::sin(s)}, i % 100 == 0 ? 0b0110 : 0),
          kDt_s);
      visited += tick.step.visited;
      scene.navigation->fill(snapshot);
      link.snapshots.publish(snapshot);
      if (i % 7 == 0) {
        scene.navigation->undoSolve();
        scene.navigation->tick(handAt({0.05 * std::sin(s * 3), 0, 0}), kDt_s);
      }
    }
    const test::ForbiddenCalls calls = guard.calls();
    EXPECT_EQ(calls.total(), 0u) << calls.first;
    EXPECT_GT(visited, 3000u);
  }
}

TEST(Navigation, GivesTheLoaderTheProxysPositionAndVelocity) {
  Scene scene;
  EXPECT_EQ(scene.navigation->focus().active_tile, kNoTile);
  const ProxyPlace place = scene.somewhere(30);
  ASSERT_TRUE(scene.command(Kind::jump, place));
  const ReaderFocus focus = scene.navigation->focus();
  EXPECT_EQ(focus.active_tile, place.tile);
  EXPECT_EQ(focus.active_node, (NodeId{place.segment.cell, place.segment.segment}));
  EXPECT_NEAR(focus.radius_um, 150, 1e-9);
  ASSERT_TRUE(scene.command(Kind::free));
  for (int i = 0; i < 1000; ++i) scene.navigation->tick(handAt({2e-5 * i, 0, 0}), kDt_s);
  EXPECT_EQ(scene.navigation->focus().active_tile, kNoTile);
  EXPECT_NEAR(scene.navigation->focus().v_W.x(), 0.02 * 2500, 1);  // 0.02 m/s at 2500 um a metre
}

// The proxy of bounded climb jumps, but the force does not.
TEST(Navigation, TheAnchorKeepsTheForceContinuousWhereTheProxyJumps) {
  const auto largest = [](AnchorUse use, double& jump_m) {
    NavigationOptions options;
    options.force.ramp_s = 0;
    options.force.max_slew_N_s = 1e9;  // the limits of the force law are not tested here
    options.force.max_force_N = 1e9;
    options.workspace.drift_speed_m_s = 0;
    options.anchor_use = use;
    Scene scene(options, SolverMethod::climb);
    EXPECT_EQ(scene.navigation->anchored(), use != AnchorUse::never);
    EXPECT_TRUE(scene.command(Kind::jump, scene.somewhere(30)));
    Vector3d last_N = Vector3d::Zero(), last_p_D = Vector3d::Zero(), last_h_D = Vector3d::Zero();
    double step_N = 0;
    for (int i = 0; i < 8000; ++i) {
      const double s = 1e-3 * i;
      const Vector3d h_D = 0.03 * Vector3d(std::sin(s), std::sin(1.7 * s), std::sin(2.3 * s));
      const NavigationTick& tick = scene.navigation->tick(handAt(h_D), kDt_s);
      if (i > 0) {
        jump_m = std::max(jump_m, (tick.p_D - last_p_D).norm());
        step_N = std::max(step_N, (forceOf(tick) - last_N).norm());
        if (use != AnchorUse::never) {
          // Bound: K ((v0 + c_v speed) dt + |dh|). The speed is at most 0.13 m/s here.
          EXPECT_LE((forceOf(tick) - last_N).norm(), 200 * ((0.1 + 0.13) * kDt_s + (h_D - last_h_D).norm()));
        }
      }
      EXPECT_LT((forceOf(tick) - 200 * (tick.anchor_D - tick.h_D)).norm(), 1e-9);
      last_N = forceOf(tick);
      last_p_D = tick.p_D;
      last_h_D = h_D;
    }
    return step_N;
  };
  double jump_m = 0;
  EXPECT_LT(largest(AnchorUse::by_method, jump_m), 0.08);
  EXPECT_GT(jump_m, 0.003);
  EXPECT_GT(largest(AnchorUse::never, jump_m), 0.4);
}

TEST(Navigation, TheAnchorStaysWhereItIsInTheDeviceUnderZoomAndRotationAndIsTheProxyAfterAJump) {
  NavigationOptions options;
  options.force.ramp_s = 0;
  options.anchor.speed_m_s = 0;  // so that the anchor stays behind
  options.anchor.hand_share = 0;
  Scene scene(options, SolverMethod::climb);
  ASSERT_TRUE(scene.command(Kind::jump, scene.somewhere(30)));
  Vector3d offset_D = Vector3d::Zero();
  const Vector3d h_D(0.02, 0.01, 0);
  for (int i = 0; i < 200; ++i) {
    const NavigationTick& tick = scene.navigation->tick(handAt(1e-2 * std::min(i, 100) * h_D), kDt_s);
    offset_D = tick.anchor_D - tick.p_D;
  }
  ASSERT_GT(offset_D.norm(), 1e-3);
  const NavigationTick before = scene.navigation->tick(handAt(h_D), kDt_s);
  NavigationCommand command;
  command.kind = Kind::zoom;
  command.factor = 0.9;
  ASSERT_TRUE(scene.navigation->apply(command, h_D));
  command.kind = Kind::rotate;
  command.about_x_rad = 0.2;
  ASSERT_TRUE(scene.navigation->apply(command, h_D));
  const NavigationTick after = scene.navigation->tick(handAt(h_D), kDt_s);
  // The anchor has not moved in the device, wherever the proxy has gone.
  EXPECT_LT((after.anchor_D - before.anchor_D).norm(), 1e-9);
  ASSERT_TRUE(scene.command(Kind::jump, scene.somewhere(50), h_D));
  const NavigationTick jumped = scene.navigation->tick(handAt(h_D), kDt_s);
  EXPECT_EQ(jumped.anchor_D, jumped.p_D);
  NavigationSnapshot snapshot;
  scene.navigation->fill(snapshot);
  EXPECT_EQ(snapshot.anchor_D, jumped.anchor_D);
}

TEST(Navigation, RefusesOptionsThatMakeNoSense) {
  const auto refuses = [](auto change) {
    NavigationOptions options;
    change(options);
    EXPECT_THROW(Scene{options}, UsageError);
  };
  refuses([](NavigationOptions& o) { o.force.stiffness_N_m = -1; });
  refuses([](NavigationOptions& o) { o.workspace.zoom_um = kNaN; });
  refuses([](NavigationOptions& o) { o.drift_force_N_s = -1; });
  refuses([](NavigationOptions& o) { o.anchor.speed_m_s = -1; });
  refuses([](NavigationOptions& o) { o.leap = 1.1; });
  refuses([](NavigationOptions& o) { o.leap = kNaN; });
}

}  // namespace
}  // namespace filiform
