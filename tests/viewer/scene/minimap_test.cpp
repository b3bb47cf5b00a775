#include "viewer/scene/minimap.h"

#include "viewer/scene/pointer.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace filiform {
namespace {

TEST(Minimaps, KeepProportionsAndTurnBack) {
  const Minimap map({-100, 0, 0}, {300, 200, 50}, 200, 300);
  EXPECT_DOUBLE_EQ(map.px_um(), 0.5);
  EXPECT_DOUBLE_EQ(map.x({-100, 0, 9}), 0);
  EXPECT_DOUBLE_EQ(map.x({300, 0, 9}), 200);
  EXPECT_DOUBLE_EQ(map.y({0, 200, 9}), 100);  // up is up
  EXPECT_DOUBLE_EQ(map.y({0, 0, 9}), 200);
  const Vector3d p_W(12, 34, 5);
  EXPECT_LT((map.toWorld(map.x(p_W), map.y(p_W), 5) - p_W).norm(), 1e-12);
}

TEST(Minimaps, ASmallBoxStaysToBeSeenAndANestedOneIsATenth) {
  const Minimap map({0, 0, 0}, {1000, 1000, 0}, 100, 100);
  const Minimap::Box small = map.box(Vector3d(500, 500, 0), 0.001, 4);
  EXPECT_DOUBLE_EQ(small.right - small.left, 4);
  const Minimap near = map.around({500, 500, 0}, 30, 80, 80);
  const Minimap::Box nested = near.box(Vector3d(500, 500, 0), 30, 0);
  EXPECT_NEAR(nested.right - nested.left, 8, 1e-12);
  EXPECT_NEAR(nested.left, 36, 1e-12);
  const Minimap point({5, 5, 5}, {5, 5, 5}, 10, 10);  // without extent
  EXPECT_TRUE(std::isfinite(point.x({5, 5, 5})));
}

TEST(ScaleBars, AreRoundAndFit) {
  EXPECT_EQ(scaleBar(0.5, 200).text, "100 um");
  EXPECT_EQ(scaleBar(0.5, 199).text, "50 um");
  EXPECT_EQ(scaleBar(20, 200).text, "2 mm");
  EXPECT_EQ(scaleBar(0.001, 200).text, "200 nm");
  for (double um_px = 1e-5; um_px < 1e5; um_px *= 1.37) {
    const ScaleBar bar = scaleBar(um_px, 200);
    EXPECT_LE(bar.length_px, 200 * (1 + 1e-12));
    EXPECT_GT(bar.length_px, 200 / 2.6);
    EXPECT_NEAR(bar.length_px * um_px, bar.length_um, 1e-9 * bar.length_um);
  }
}

// The hand appears under the pointer, at the depth of the proxy.
TEST(Pointer, TheHandIsSeenUnderThePointer) {
  Workspace workspace{WorkspaceOptions{.zoom_um = 100}};
  workspace.place({1000, -50, 7}, {0.01, 0, -0.005});
  workspace.rotate(0.4, -0.3, {1000, -50, 7});
  const PictureSize size{800, 600};
  const EyeView view = viewOf(workspaceCamera(workspace, size.aspect()), size.aspect());
  const Vector3d proxy_W(1000, -50, 7);
  for (const auto& [x, y] : {std::pair{400.0, 300.0}, std::pair{250.0, 380.0}, std::pair{500.0, 200.0}}) {
    const Vector3d target_D = pointedAt_D(view, x, y, size, workspace, proxy_W, 0);
    const ScreenPoint seen = project(view, workspace.toWorld(target_D), size);
    EXPECT_NEAR(seen.x, x, 1e-6);
    EXPECT_NEAR(seen.y, y, 1e-6);
    EXPECT_NEAR(target_D.z(), -0.005, 1e-9);
    EXPECT_NEAR(pointedAt_D(view, x, y, size, workspace, proxy_W, 0.01).z(), 0.005, 1e-9);
  }
  const Vector3d far_D = pointedAt_D(view, 1e6, -1e6, size, workspace, proxy_W, 1);
  EXPECT_TRUE((far_D.array() <= 0.06).all() && (far_D.array() >= -0.06).all());
  // A point behind the eye has no pixel.
  EXPECT_TRUE(pointedAt_D(view, 1, 1, size, workspace, view.eye_W, 0).allFinite());
}

TEST(Pointer, AcrossThePictureIsHalfATurn) {
  const Turn turn = turnOf(0, 600, {800, 600});
  EXPECT_DOUBLE_EQ(turn.about_x_rad, std::numbers::pi);
  EXPECT_DOUBLE_EQ(turn.about_y_rad, 0);
  EXPECT_DOUBLE_EQ(turnOf(300, 0, {800, 600}).about_y_rad, std::numbers::pi / 2);
}

}  // namespace
}  // namespace filiform
