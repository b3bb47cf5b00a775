#include "viewer/window/travel/internal/viewpoint.h"

#include <gtest/gtest.h>

namespace filiform::internal {
namespace {

const PictureSize kPictureSize{1280, 800};
const Vector3d kLo_W(-500, -1000, -500), kHi_W(500, 1000, 500);

NavigationSnapshot at(const Vector3d& centre_W, double zoom_um) {
  NavigationSnapshot now;
  now.centre_W = centre_W;
  now.zoom_um = zoom_um;
  return now;
}

ScreenPoint pixelOf(const Camera& camera, const Vector3d& p_W) {
  return project(viewOf(camera, kPictureSize.aspect()), p_W, kPictureSize);
}

TEST(ViewpointShift, KeepsWhatIsUnderThePointerThere) {
  for (const bool everything : {false, true}) {
    Viewpoint eye(WorkspaceOptions{});
    if (everything) eye.nextOverview();
    const NavigationSnapshot now = at({10, 20, 30}, 200);
    const Camera before = eye.look(now, kLo_W, kHi_W, kPictureSize.aspect(), 0);
    const Vector3d focus_W = before.focus_W();
    eye.pan(100, -40, kPictureSize);
    const Camera after = eye.look(now, kLo_W, kHi_W, kPictureSize.aspect(), 0.1);
    EXPECT_NEAR(pixelOf(after, focus_W).x, pixelOf(before, focus_W).x + 100, 1e-6);
    EXPECT_NEAR(pixelOf(after, focus_W).y, pixelOf(before, focus_W).y - 40, 1e-6);
    EXPECT_EQ(after.rotation_VW, before.rotation_VW);
    eye.centre();
    EXPECT_EQ(eye.look(now, kLo_W, kHi_W, kPictureSize.aspect(), 0.2).eye_W, before.eye_W);
  }
}

TEST(ViewpointShift, EndsWithAJumpAndIsBounded) {
  Viewpoint eye(WorkspaceOptions{});
  eye.pan(1e9, -1e9, kPictureSize);
  EXPECT_LE(eye.shift().cwiseAbs().maxCoeff(), 4);
  eye.depart(1, true);
  EXPECT_EQ(eye.shift(), Eigen::Vector2d(0, 0));
}

TEST(ViewpointOverview, ShowsFarCellsSecondIfThereAreAny) {
  Viewpoint eye(WorkspaceOptions{});
  const auto next = [&](bool has_far) {
    eye.nextOverview(has_far);
    return std::pair(eye.isOverview(), eye.showsFar());
  };
  EXPECT_EQ(next(false), std::pair(true, false));
  EXPECT_EQ(next(false), std::pair(false, false));
  EXPECT_EQ(next(true), std::pair(true, false));
  EXPECT_EQ(next(true), std::pair(true, true));
  EXPECT_EQ(next(true), std::pair(false, false));
}

TEST(ViewpointGlide, TakesTheEyeThereInItsTime) {
  Viewpoint eye(WorkspaceOptions{});
  const auto look = [&](double x, double t) {
    return eye.look(at({x, 0, 0}, 100), kLo_W, kHi_W, kPictureSize.aspect(), t).focus_W().x();
  };
  look(0, 0);
  eye.nextOverview();
  eye.depart(1, false);
  EXPECT_FALSE(eye.isOverview());
  EXPECT_NEAR(look(100, 1), 0, 1e-6);
  const double half = look(100, 1 + Viewpoint::kFlight_s / 2);
  EXPECT_NEAR(half, 50, 1e-6);
  EXPECT_TRUE(eye.isGliding());
  EXPECT_NEAR(eye.workspace().centre_W().x(), 100, 1e-9);  // the hand does not glide
  EXPECT_NEAR(look(100, 1 + Viewpoint::kFlight_s), 100, 1e-6);
  EXPECT_FALSE(eye.isGliding());
  eye.depart(2, true);
  EXPECT_NEAR(look(-50, 2), -50, 1e-6);
}

}  // namespace
}  // namespace filiform::internal
