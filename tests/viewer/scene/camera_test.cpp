#include "viewer/scene/camera.h"

#include "index/errors.h"
#include "solver/workspace/workspace.h"

#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector4d;

Vector3d vector(std::mt19937_64& random, double size) {
  std::uniform_real_distribution<double> in(-size, size);
  return {in(random), in(random), in(random)};
}

Camera randomCamera(std::mt19937_64& random) {
  return lookAt(vector(random, 1000), vector(random, 1000), vector(random, 1));
}

TEST(Camera, LooksAtItsTargetWithUpUpwards) {
  std::mt19937_64 random(1);
  for (int round = 0; round < 100; ++round) {
    const Vector3d eye = vector(random, 100), target = vector(random, 100), up = vector(random, 1);
    const Camera camera = lookAt(eye, target, up);
    EXPECT_LT((camera.rotation_VW * camera.rotation_VW.transpose() - Matrix3d::Identity()).norm(), 1e-12);
    EXPECT_NEAR(camera.rotation_VW.determinant(), 1, 1e-12);
    const Vector3d seen = camera.rotation_VW * (target - eye), up_V = camera.rotation_VW * up;
    EXPECT_NEAR(seen.x(), 0, 1e-9);
    EXPECT_NEAR(seen.y(), 0, 1e-9);
    EXPECT_NEAR(-seen.z(), (target - eye).norm(), 1e-9);
    EXPECT_NEAR(up_V.x(), 0, 1e-9);
    EXPECT_GT(up_V.y(), 0);
    EXPECT_LT((camera.focus_W() - target).norm(), 1e-9);
  }
}

TEST(Camera, LooksStraightDown) {
  const Camera camera = lookAt({0, 10, 0}, {0, 0, 0}, {0, 1, 0});
  EXPECT_LT((camera.rotation_VW * camera.rotation_VW.transpose() - Matrix3d::Identity()).norm(), 1e-12);
  EXPECT_NEAR((camera.rotation_VW * Vector3d(0, -10, 0)).z(), -10, 1e-12);
}

TEST(Camera, RefusesWhatCannotBeSeen) {
  EXPECT_THROW(lookAt({1, 2, 3}, {1, 2, 3}), UsageError);
  EXPECT_THROW(lookAt({NAN, 2, 3}, {1, 2, 3}), UsageError);
  EXPECT_THROW(overview({1, 0, 0}, {0, 1, 1}, 0, 0, 1), UsageError);
  EXPECT_THROW(orbit(Camera{}, 0, 0, 0), UsageError);
  EXPECT_THROW(orbit(Camera{}, NAN, 0), UsageError);
}

// Compares project() with the matrix that the graphics card gets.
TEST(Camera, PixelsAgreeWithTheProjectionMatrix) {
  std::mt19937_64 random(2);
  const PictureSize size{640, 400};
  int inside = 0;
  for (int round = 0; round < 1000; ++round) {
    const Camera camera = randomCamera(random);
    EyeView view = viewOf(camera, size.aspect());
    view.frustum.left *= 0.7;  // not symmetric
    const Vector3d p_W = camera.focus_W() + vector(random, camera.focus_um / 2);
    const Vector3d p_V = view.toView(p_W);
    const Vector4d clip = projection(view.frustum) * Vector4d(p_V.x(), p_V.y(), p_V.z(), 1);
    if (!(clip.w() > 0)) continue;
    const ScreenPoint point = project(view, p_W, size);
    EXPECT_NEAR(point.x, (clip.x() / clip.w() + 1) / 2 * size.width, 1e-6);
    EXPECT_NEAR(point.y, (1 - clip.y() / clip.w()) / 2 * size.height, 1e-6);
    EXPECT_NEAR(point.depth_um, clip.w(), 1e-9);
    inside += point.x > 0 && point.x < size.width && point.y > 0 && point.y < size.height;
  }
  EXPECT_GT(inside, 300);
}

TEST(Camera, NearAndFarAreTheEndsOfDepth) {
  const Frustum f{-1, 2, -1, 1, 3, 700};
  const Vector4d at_near = projection(f) * Vector4d(0, 0, -3, 1), at_far = projection(f) * Vector4d(0, 0, -700, 1);
  EXPECT_NEAR(at_near.z() / at_near.w(), -1, 1e-12);
  EXPECT_NEAR(at_far.z() / at_far.w(), 1, 1e-12);
}

TEST(Camera, OverviewHoldsTheWholeBoxAndLittleElse) {
  std::mt19937_64 random(3);
  for (int round = 0; round < 100; ++round) {
    const Vector3d middle = vector(random, 1e5), half = vector(random, 500).cwiseAbs() + Vector3d::Ones();
    const PictureSize size = round % 2 == 0 ? PictureSize{1280, 800} : PictureSize{300, 900};
    const Camera camera =
        overview(middle - half, middle + half, vector(random, 3).x(), vector(random, 1.5).x(), size.aspect());
    const EyeView view = viewOf(camera, size.aspect());
    double margin = INFINITY;  // parts of the width or height
    for (int corner = 0; corner < 8; ++corner) {
      const Vector3d side(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
      const ScreenPoint p = project(view, middle + half.cwiseProduct(side), size);
      EXPECT_GT(p.depth_um, view.frustum.near_um);
      EXPECT_LT(p.depth_um, view.frustum.far_um);
      margin = std::min({margin, p.x / size.width, 1 - p.x / size.width, p.y / size.height, 1 - p.y / size.height});
    }
    EXPECT_GT(margin, 0);
    EXPECT_LT(margin, 0.1);
  }
}

TEST(Camera, OrbitKeepsTheFocusAndTheDistance) {
  std::mt19937_64 random(4);
  for (int round = 0; round < 100; ++round) {
    const Camera camera = randomCamera(random);
    const Vector3d angles = vector(random, 2);
    const Camera turned = orbit(camera, angles.x(), angles.y(), 1.5);
    EXPECT_LT((turned.focus_W() - camera.focus_W()).norm(), 1e-9 * camera.focus_um);
    EXPECT_NEAR(turned.focus_um, 1.5 * camera.focus_um, 1e-9 * camera.focus_um);
  }
}

TEST(Camera, YawTakesTheEyeToTheRightAndPitchUp) {
  const Camera front = lookAt({0, 0, 10}, {0, 0, 0});
  EXPECT_LT((orbit(front, std::numbers::pi / 2, 0).eye_W - Vector3d(10, 0, 0)).norm(), 1e-12);
  EXPECT_LT((orbit(front, 0, std::numbers::pi / 2).eye_W - Vector3d(0, 10, 0)).norm(), 1e-12);
}

// A point held under the hand keeps its place on the screen at any zoom and rotation.
TEST(Camera, FollowsTheWorkspace) {
  const PictureSize size{1280, 800};
  Workspace workspace({.zoom_um = 300});
  const Vector3d proxy_W(100, -200, 5000), proxy_D(0.02, 0.01, -0.03);
  workspace.place(proxy_W, proxy_D);
  const ScreenPoint before = project(viewOf(workspaceCamera(workspace, size.aspect()), size.aspect()), proxy_W, size);
  workspace.rotate(0.3, -0.8, proxy_W);
  workspace.setZoom(40, proxy_W);
  const EyeView view = viewOf(workspaceCamera(workspace, size.aspect()), size.aspect());
  const ScreenPoint after = project(view, proxy_W, size);
  EXPECT_NEAR(after.x, before.x, 1e-6);
  EXPECT_NEAR(after.y, before.y, 1e-6);

  // The front of the device's box fills the stated part of the height; up is the device's up.
  const WorkspaceOptions& box = workspace.options();
  const ScreenPoint top = project(view, workspace.toWorld({0, box.hi_D.y(), box.hi_D.z()}), size);
  const ScreenPoint bottom = project(view, workspace.toWorld({0, box.lo_D.y(), box.hi_D.z()}), size);
  EXPECT_NEAR(bottom.y - top.y, 0.8 * size.height, 1e-6);
  const ScreenPoint back = project(view, workspace.toWorld({0, 0, box.lo_D.z()}), size);
  EXPECT_LT(back.depth_um, view.frustum.far_um);
}

TEST(Camera, PickRayHitsWhatIsUnderThePixel) {
  std::mt19937_64 random(5);
  const PictureSize size{500, 300};
  for (int round = 0; round < 100; ++round) {
    const Camera camera = randomCamera(random);
    EyeView view = viewOf(camera, size.aspect());
    view.frustum.right *= 1.3;
    const Vector3d p_W = camera.focus_W() + vector(random, camera.focus_um / 10);
    const ScreenPoint at = project(view, p_W, size);
    const RayQuery ray = pickRay(view, at.x, at.y, size, 2);
    const Vector3d to = p_W - ray.origin_W;
    EXPECT_LT(to.cross(ray.direction).norm(), 1e-9 * to.norm());
    EXPECT_GT(to.dot(ray.direction), 0);
    EXPECT_LT(to.norm(), ray.length_um);
    // Near the middle of the picture, the rim of the cone is two pixels away.
    const RayQuery beside = pickRay(view, size.width / 2.0, size.height / 2.0 + 2, size, 2);
    const RayQuery middle = pickRay(view, size.width / 2.0, size.height / 2.0, size, 2);
    EXPECT_NEAR(beside.direction.cross(middle.direction).norm(), ray.slope, 0.1 * ray.slope);
  }
}

TEST(Camera, PlanesHoldExactlyWhatIsOnTheScreen) {
  std::mt19937_64 random(6);
  const PictureSize size{640, 480};
  int inside = 0, outside = 0;
  for (int round = 0; round < 3000; ++round) {
    const Camera camera = randomCamera(random);
    EyeView view = viewOf(camera, size.aspect());
    view.frustum.bottom *= 0.5;
    const LevelView levels = levelView(view, size);
    ASSERT_EQ(levels.planes.size(), 6u);
    const Vector3d p_W = camera.focus_W() + vector(random, camera.focus_um);
    const ScreenPoint at = project(view, p_W, size);
    const bool seen = at.depth_um >= view.frustum.near_um && at.depth_um <= view.frustum.far_um && at.x >= 0 &&
                      at.x <= size.width && at.y >= 0 && at.y <= size.height;
    bool within = true;
    for (const LevelView::Plane& plane : levels.planes) within &= plane.n.dot(p_W) >= plane.d;
    EXPECT_EQ(seen, within);
    ++(seen ? inside : outside);
  }
  EXPECT_GT(inside, 300);
  EXPECT_GT(outside, 300);
}

TEST(Camera, DepthIsFittedToTheBox) {
  const Camera camera = fitDepth(lookAt({0, 0, 100}, {0, 0, 0}), {-10, -10, -50}, {10, 10, 20});
  EXPECT_NEAR(camera.near_um, 80, 1);
  EXPECT_NEAR(camera.far_um, 150, 2);
  const Camera inside = fitDepth(lookAt({0, 0, 0}, {0, 0, -5}), {-1000, -1000, -1000}, {1000, 1000, 1000});
  EXPECT_GE(inside.near_um * kDepthRatio, inside.far_um * (1 - 1e-12));
  EXPECT_LT(inside.near_um, 5);
  EXPECT_GT(inside.far_um, 1000);
}

TEST(Camera, ParallelViewsKeepTheFocusAndHaveNoPerspective) {
  const PictureSize size{640, 480};
  const Camera camera = lookAt({10, 20, 300}, {0, 0, 0});
  const Camera far = parallel(camera);
  EXPECT_LT((far.focus_W() - camera.focus_W()).norm(), 1e-6);
  const EyeView near_view = viewOf(camera, size.aspect()), far_view = viewOf(far, size.aspect());
  const auto width = [&](const EyeView& view, double depth_um) {
    const Vector3d at = camera.focus_W() - depth_um * camera.rotation_VW.row(2).transpose();
    return project(view, at + 10 * camera.rotation_VW.row(0).transpose(), size).x - project(view, at, size).x;
  };
  EXPECT_NEAR(width(far_view, 0), width(near_view, 0), 1e-6);
  EXPECT_NEAR(width(far_view, 100) / width(far_view, -100), 1, 0.003);
  EXPECT_LT(width(near_view, 100) / width(near_view, -100), 0.6);
}

}  // namespace
}  // namespace filiform
