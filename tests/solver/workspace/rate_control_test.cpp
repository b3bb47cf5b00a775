#include "solver/workspace/rate_control.h"

#include "index/errors.h"
#include "tests/support/numbers.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using Eigen::Vector3d;
using test::kDt_s;

TEST(RateControl, RunsAheadAtTheSpeedThatIsAsked) {
  RateControl rate;
  const Vector3d p_D(0.01, 0.02, 0.03), v_D(0.1, 0, -0.05);
  Vector3d h_D;
  for (int i = 0; i < 10; ++i) {
    h_D = rate.probe(p_D, v_D, kDt_s);
    rate.moveProxy(p_D);
  }
  EXPECT_NEAR((h_D - p_D - 10 * kDt_s * v_D).norm(), 0, 1e-15);
}

TEST(RateControl, ProxyThatFollowsIsLedAtThatSpeed) {
  RateControl rate;
  Vector3d p_D = Vector3d::Zero();
  for (int i = 0; i < 1000; ++i) {
    p_D.x() = rate.probe(p_D, {0.1, 0.1, 0}, kDt_s).x();  // a neurite along x
    rate.moveProxy(p_D);
  }
  EXPECT_NEAR(p_D.x(), 0.1, 0.001);
}

TEST(RateControl, StaysOnItsLeashAndComesBackAtRest) {
  RateControl rate({.leash_m = 0.02});
  const Vector3d p_D(0.01, 0, 0);
  for (int i = 0; i < 1000; ++i) {
    const Vector3d h_D = rate.probe(p_D, {0, 0.1, 0}, kDt_s);
    rate.moveProxy(p_D);
    ASSERT_LE((h_D - p_D).norm(), 0.02 + 1e-15);
  }
  EXPECT_NEAR((rate.probe(p_D, {0, 0.1, 0}, kDt_s) - p_D).norm(), 0.02, 1e-15);
  EXPECT_EQ(rate.probe(p_D, Vector3d::Zero(), kDt_s), p_D);
}

TEST(RateControl, AnyRateLeavesTheProbeNearTheProxy) {
  RateControl rate;
  const double nan = std::numeric_limits<double>::quiet_NaN(), huge = std::numeric_limits<double>::max();
  for (const double v : {nan, huge, -huge, std::numeric_limits<double>::infinity(), 1e300, 5e-324}) {
    for (const double dt_s : {kDt_s, 0.0, -1.0, nan, huge}) {
      const Vector3d h_D = rate.probe(Vector3d::Zero(), {v, 1, -v}, dt_s);
      ASSERT_TRUE(h_D.allFinite()) << v << " " << dt_s;
      ASSERT_LE(h_D.norm(), 0.02 + 1e-15);
      rate.moveProxy(Vector3d::Constant(v));
      const double factor = rate.zoomFactor(v, dt_s);
      ASSERT_TRUE(factor >= std::exp(-1) - 1e-15 && factor <= std::exp(1) + 1e-15) << v << " " << dt_s;
    }
  }
}

// Recordings are replayed on other machines.
TEST(RateControl, ZoomHasTheSameBitsOnEveryMachine) {
  const RateControl rate({.zoom_per_rad = 1});
  for (int i = -1000; i <= 1000; ++i) {
    const double x = 0.001 * i;
    ASSERT_NEAR(rate.zoomFactor(x, 1) / std::exp(x), 1, 1e-15) << x;
  }
  EXPECT_EQ(rate.zoomFactor(0.3, 1), 0x1.599058c8c1a96p+0);
  EXPECT_EQ(rate.zoomFactor(-0.7, 1), 0x1.fc80db9dd5540p-2);
}

TEST(RateControl, TurningTheCapZooms) {
  RateControl rate({.zoom_per_rad = 2});
  double zoom = 1;
  for (int i = 0; i < 1000; ++i) zoom *= rate.zoomFactor(-0.5, kDt_s);
  EXPECT_NEAR(zoom, std::exp(-1), 1e-9) << "clockwise zooms in";
  EXPECT_THROW(RateControl({.leash_m = 0}), UsageError);
  EXPECT_THROW(RateControl({.zoom_per_rad = std::nan("")}), UsageError);
}

}  // namespace
}  // namespace filiform
