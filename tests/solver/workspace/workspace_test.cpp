#include "solver/workspace/workspace.h"

#include "index/errors.h"
#include "tests/support/numbers.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using Eigen::Matrix3d;
using test::kInfinity;
using test::kNaN;
using test::logUniform;

double between(std::mt19937_64& random, double lo, double hi) {
  return std::uniform_real_distribution<double>(lo, hi)(random);
}
Vector3d vector(std::mt19937_64& random, double size) {
  return {between(random, -size, size), between(random, -size, size), between(random, -size, size)};
}

TEST(Workspace, ZoomIsTheWorldAcrossTheSpan) {
  WorkspaceOptions options;
  options.zoom_um = 300;
  const Workspace workspace(options);
  EXPECT_NEAR((workspace.toWorld({0.06, 0, 0}) - workspace.toWorld({-0.06, 0, 0})).norm(), 300, 1e-9);
  EXPECT_NEAR(workspace.zoom_um(), 300, 1e-9);
  EXPECT_TRUE(workspace.centre_W().isZero(0));
}

TEST(Workspace, MapsThereAndBack) {
  std::mt19937_64 random(1);
  for (int round = 0; round < 200; ++round) {
    WorkspaceOptions options;
    options.zoom_um = logUniform(random, 1, 1e6);
    Workspace workspace(options);
    const Vector3d proxy_W = vector(random, 1e4);
    workspace.place(proxy_W, vector(random, 0.05));
    workspace.rotate(between(random, -3, 3), between(random, -3, 3), proxy_W);
    const Vector3d p_D = vector(random, 0.06);
    EXPECT_LT((workspace.toDevice(workspace.toWorld(p_D)) - p_D).norm(), 1e-10);
    EXPECT_LT((workspace.rotationMatrix() * workspace.rotationMatrix().transpose() - Matrix3d::Identity()).norm(),
              1e-12);
  }
}

TEST(Workspace, ZoomAndRotationLeaveTheProxyWhereItIsFelt) {
  constexpr std::uint64_t kSeed = 7;
  SCOPED_TRACE(kSeed);
  std::mt19937_64 random(kSeed);
  for (int round = 0; round < 500; ++round) {
    WorkspaceOptions options;
    options.zoom_um = logUniform(random, 1e-6, 1e6);
    Workspace workspace(options);
    const Vector3d proxy_W = vector(random, logUniform(random, 1, 1e9));
    workspace.place(proxy_W, vector(random, 0.06));
    for (int turn = 0; turn < 20; ++turn) {
      const Vector3d p_D = workspace.toDevice(proxy_W);
      if (random() % 2)
        workspace.rotate(between(random, -3, 3), between(random, -3, 3), proxy_W);
      else
        workspace.setZoom(logUniform(random, 1e-9, 1e9), proxy_W);
      ASSERT_LT((workspace.toDevice(proxy_W) - p_D).norm(), 1e-12);
      ASSERT_GE(workspace.zoom_um(), Workspace::kMinZoom_um * (1 - 1e-12));
      ASSERT_LE(workspace.zoom_um(), Workspace::kMaxZoom_um * (1 + 1e-12));
    }
  }
}

TEST(Workspace, RotationTurnsTheWorldAsItIsSeen) {
  Workspace workspace(WorkspaceOptions{});
  const Vector3d up_W = workspace.toWorld({0, 0.01, 0});
  workspace.rotate(M_PI / 2, 0, Vector3d::Zero());  // up turns towards the user
  EXPECT_LT((workspace.toDevice(up_W) - Vector3d(0, 0, 0.01)).norm(), 1e-12);
  Workspace other(WorkspaceOptions{});
  const Vector3d right_W = other.toWorld({0.01, 0, 0});
  other.rotate(0, M_PI / 2, Vector3d::Zero());  // right turns away from the user
  EXPECT_LT((other.toDevice(right_W) - Vector3d(0, 0, -0.01)).norm(), 1e-12);
}

TEST(Workspace, RestsWhileTheProxyIsInTheStaticRegion) {
  Workspace workspace(WorkspaceOptions{});
  const Vector3d p_W = workspace.toWorld({0.0449, -0.0449, 0.0449});
  EXPECT_TRUE(workspace.inStatic({0.0449, -0.0449, 0.0449}));
  EXPECT_TRUE(workspace.drift(p_W, 1e-3).isZero(0));
  EXPECT_FALSE(workspace.inStatic({0, 0.0451, 0}));
}

TEST(Workspace, BringsTheProxyBackIntoTheStaticRegionSmoothly) {
  Workspace workspace(WorkspaceOptions{});
  const Vector3d p_W = workspace.toWorld({0.058, 0, -0.09});
  const double most = workspace.options().drift_speed_m_s * 1e-3;
  Vector3d last = Vector3d::Zero();
  for (int tick = 0; tick < 5000; ++tick) {
    const Vector3d before = workspace.toDevice(p_W), shift = workspace.drift(p_W, 1e-3);
    ASSERT_LE(shift.norm(), most * (1 + 1e-9));
    ASSERT_LT((workspace.toDevice(p_W) - (before - shift)).norm(), 1e-12);
    if (tick > 0) {
      ASSERT_LT((shift - last).norm(), 0.02 * most);  // no jerk: the speed depends on the depth
    }
    last = shift;
  }
  EXPECT_LT((workspace.toDevice(p_W) - Vector3d(0.045, 0, -0.045)).cwiseAbs().maxCoeff(), 1e-4);
}

TEST(Workspace, NeverDriftsFasterThanStatedNorPastTheBorder) {
  constexpr std::uint64_t kSeed = 11;
  SCOPED_TRACE(kSeed);
  std::mt19937_64 random(kSeed);
  for (int round = 0; round < 3000; ++round) {
    WorkspaceOptions options;
    options.zoom_um = logUniform(random, 1e-6, 1e6);
    options.static_fraction = random() % 4 ? between(random, 0, 1) : static_cast<double>(random() % 2);
    options.drift_speed_m_s = random() % 5 ? logUniform(random, 1e-4, 10) : 0.0;
    Workspace workspace(options);
    const double dt = logUniform(random, 1e-6, 1.0);
    const Vector3d p_D = vector(random, 0.2);
    const Vector3d p_W = workspace.toWorld(p_D);
    workspace.place(p_W, p_D);
    if (random() % 3 == 0) workspace.startCentring();
    const bool centring = workspace.centring();
    const Vector3d shift = workspace.drift(p_W, dt);
    ASSERT_LE(shift.norm(), options.drift_speed_m_s * dt * (1 + 1e-12));
    const Vector3d after = workspace.toDevice(p_W);
    for (int axis = 0; axis < 3; ++axis) {
      ASSERT_LE(std::abs(after[axis]), std::abs(p_D[axis]) + 1e-15);
      const double border = centring ? 0.0 : std::min(std::abs(p_D[axis]), 0.06 * options.static_fraction);
      ASSERT_GE(std::copysign(1.0, p_D[axis]) * after[axis], border - 1e-12);
    }
  }
}

TEST(Workspace, CentringBringsTheProxyToTheCentreAndEnds) {
  Workspace workspace(WorkspaceOptions{});
  const Vector3d p_W = workspace.toWorld({0.02, 0.03, -0.01});
  workspace.startCentring();
  int ticks = 0;
  while (workspace.centring() && ticks < 10000) {
    workspace.drift(p_W, 1e-3);
    ++ticks;
  }
  EXPECT_LT(workspace.toDevice(p_W).norm(), 1e-15);
  EXPECT_NEAR(ticks, 0.0374166 / 0.1 * 1000, 3);
}

TEST(Workspace, ArgumentsThatAreNotFiniteMoveNothing) {
  Workspace workspace(WorkspaceOptions{});
  const Vector3d p_D = workspace.toDevice({10, 20, 30});
  for (const double bad : {kNaN, kInfinity, -kInfinity}) {
    workspace.place({bad, 0, 0}, Vector3d::Zero());
    workspace.place(Vector3d::Zero(), {0, bad, 0});
    workspace.setZoom(bad, Vector3d::Zero());
    workspace.setZoom(10, {bad, 0, 0});
    workspace.rotate(bad, 0, Vector3d::Zero());
    workspace.rotate(0, 1, {0, 0, bad});
    EXPECT_TRUE(workspace.drift({bad, 0, 0}, 1e-3).isZero(0));
    EXPECT_TRUE(workspace.drift({1e9, 0, 0}, bad > 0 ? -bad : bad).isZero(0));
  }
  workspace.setZoom(0, Vector3d::Zero());
  workspace.setZoom(-5, Vector3d::Zero());
  EXPECT_EQ(workspace.toDevice({10, 20, 30}), p_D);
}

TEST(Workspace, IsLaidAsASnapshotSays) {
  Workspace moved{WorkspaceOptions{.lo_D = {-0.05, -0.06, -0.02}, .hi_D = {0.06, 0.06, 0.06}}};
  moved.place({1e6, -20, 3}, {0.01, 0.02, -0.01});
  moved.setZoom(40, {1e6, -20, 3});
  moved.rotate(0.3, -0.8, {1e6, -20, 3});
  Workspace laid{moved.options()};
  laid.lay(moved.centre_W(), Eigen::Quaterniond(moved.rotationMatrix()), moved.zoom_um());
  for (const Vector3d& p_D : {Vector3d(0, 0, 0), Vector3d(0.05, -0.02, 0.04)})
    EXPECT_LT((laid.toWorld(p_D) - moved.toWorld(p_D)).norm(), 1e-8);
  const Vector3d before = laid.centre_W();
  laid.lay({kNaN, 0, 0}, Eigen::Quaterniond::Identity(), 10);
  laid.lay({0, 0, 0}, Eigen::Quaterniond(0, 0, 0, 0), 10);
  laid.lay({0, 0, 0}, Eigen::Quaterniond::Identity(), -1);
  EXPECT_EQ(laid.centre_W(), before);
}

TEST(Workspace, RefusesOptionsOutOfRange) {
  const auto refuses = [](auto change) {
    WorkspaceOptions options;
    change(options);
    EXPECT_THROW(Workspace{options}, UsageError);
  };
  refuses([](WorkspaceOptions& o) { o.zoom_um = 0; });
  refuses([](WorkspaceOptions& o) { o.zoom_um = kNaN; });
  refuses([](WorkspaceOptions& o) { o.static_fraction = 1.5; });
  refuses([](WorkspaceOptions& o) { o.drift_speed_m_s = -1; });
  refuses([](WorkspaceOptions& o) { o.hi_D.x() = -1; });
  refuses([](WorkspaceOptions& o) { o.lo_D.y() = -kInfinity; });
}

}  // namespace
}  // namespace filiform
