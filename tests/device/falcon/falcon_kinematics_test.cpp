#include "device/falcon/falcon_kinematics.h"

#include "tests/support/no_alloc_guard.h"
#include "tests/support/numbers.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <gtest/gtest.h>

namespace filiform {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using test::kInfinity;
using test::kNaN;

constexpr double kDegree = 3.14159265358979323846 / 180;

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  double within(double most) { return most * (2 * unit() - 1); }
  double unit() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
  Vector3d inBox(const Vector3d& centre, double half) {
    const double x = within(half), y = within(half), z = within(half);
    return centre + Vector3d(x, y, z);
  }

 private:
  std::mt19937_64 engine_;
};

// Difference between the length of a leg's shin and its nominal length, for a given arm angle and grip position.
// Computed forward along the chain; the product solves it backward.
double shinMiss_m(const Vector3d& p_F, double angle_rad, int leg) {
  const double phi = (105 - 120 * leg) * kDegree;
  const Vector3d hinge_leg(0.040, -0.02309, 0);
  const Vector3d q = Eigen::AngleAxisd(-phi, Vector3d::UnitZ()) * p_F - hinge_leg;
  const Vector3d elbow(0.060 * std::cos(angle_rad), 0, 0.060 * std::sin(angle_rad));
  const double v = q.y() - 0.025;
  const double in_plane = std::hypot(q.x() + 0.01443 - elbow.x(), q.z() - elbow.z());
  const double parallelogram = std::sqrt(0.1025 * 0.1025 - v * v);
  return in_plane - (0.01125 + 0.01125 + parallelogram);
}

TEST(FalconKinematics, EveryPlaceOfTheWorkspaceIsReachedByClosedLegs) {
  Random random(1);
  for (int i = 0; i < 30000; ++i) {
    const Vector3d p_F = random.inBox(kFalconCentre_F, kFalconReach_m);
    const auto angles = falconAngles(p_F);
    ASSERT_TRUE(angles) << p_F.transpose();
    ASSERT_TRUE(falconJacobian(p_F)) << p_F.transpose();
    for (int leg = 0; leg < 3; ++leg) ASSERT_NEAR(shinMiss_m(p_F, (*angles)[leg], leg), 0, 1e-12) << p_F.transpose();
  }
}

TEST(FalconKinematics, AgreesWithWhatWasMeasuredOnTheAxis) {
  struct Row {
    double z, angle_degrees;
    int count;
    double torque_x, torque_y, torque_z;  // N m at the most loaded arm, for 1 N
  };
  for (const Row& row : {Row{0.100, 8.01, -741, 0.047, 0.046, 0.022}, Row{0.125, 27.71, -200, 0.061, 0.060, 0.025},
                         Row{0.150, 47.24, 336, 0.071, 0.070, 0.023}}) {
    const Vector3d p_F(0, 0, row.z);
    const Vector3d angles = falconAngles(p_F).value();
    for (int leg = 0; leg < 3; ++leg) EXPECT_NEAR(angles[leg], row.angle_degrees * kDegree, 0.005 * kDegree);
    EXPECT_EQ(falconCountsOfAngles(angles)[0], row.count);
    EXPECT_NEAR(falconTorques(p_F, Vector3d::UnitX())->cwiseAbs().maxCoeff(), row.torque_x, 0.0006);
    EXPECT_NEAR(falconTorques(p_F, Vector3d::UnitY())->cwiseAbs().maxCoeff(), row.torque_y, 0.0006);
    EXPECT_NEAR(falconTorques(p_F, Vector3d::UnitZ())->cwiseAbs().maxCoeff(), row.torque_z, 0.0006);
  }
}

TEST(FalconKinematics, ForwardOfInverseIsThePlaceFromAColdStart) {
  Random random(2);
  double worst_m = 0;
  int most = 0;
  for (int i = 0; i < 60000; ++i) {
    const Vector3d p_F = random.inBox(kFalconCentre_F, kFalconReach_m);
    const FalconPlace place = falconPlace(falconAngles(p_F).value(), kFalconCentre_F);
    ASSERT_TRUE(place.reached) << p_F.transpose();
    worst_m = std::max(worst_m, (place.p_F - p_F).norm());
    most = std::max(most, place.iterations);
  }
  RecordProperty("worst_fm", std::to_string(1e15 * worst_m));
  EXPECT_LE(worst_m, 1e-12);
  EXPECT_LE(most, 9);
}

TEST(FalconKinematics, AnyPlaceOfTheWorkspaceIsAStart) {
  Random random(3);
  for (int i = 0; i < 30000; ++i) {
    const Vector3d p_F = random.inBox(kFalconCentre_F, kFalconReach_m);
    const Vector3d start_F = random.inBox(kFalconCentre_F, kFalconReach_m);
    const FalconPlace place = falconPlace(falconAngles(p_F).value(), start_F);
    ASSERT_TRUE(place.reached) << p_F.transpose() << " from " << start_F.transpose();
    ASSERT_LE((place.p_F - p_F).norm(), 1e-12);
    ASSERT_LE(place.iterations, 14);
  }
}

TEST(FalconKinematics, JacobianIsThatOfCentralDifferences) {
  Random random(4);
  double worst = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vector3d p_F = random.inBox(kFalconCentre_F, 0.95 * kFalconReach_m);
    Matrix3d numeric;
    const double h = 4e-5;  // fourth order: truncation and rounding errors are similar
    for (int axis = 0; axis < 3; ++axis) {
      const auto at = [&](double steps) { return falconAngles(p_F + steps * h * Vector3d::Unit(axis)).value(); };
      numeric.col(axis) = (8 * (at(1) - at(-1)) - (at(2) - at(-2))) / (12 * h);
    }
    const Matrix3d jacobian = falconJacobian(p_F).value();
    worst = std::max(worst, (jacobian - numeric).norm() / jacobian.norm());
  }
  EXPECT_LE(worst, 1e-9);
}

TEST(FalconKinematics, TorquesDoTheWorkOfTheForce) {
  Random random(5);
  double worst = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vector3d p_F = random.inBox(kFalconCentre_F, 0.95 * kFalconReach_m);
    const Vector3d force_N = random.inBox(Vector3d::Zero(), 8);
    const Vector3d way = random.inBox(Vector3d::Zero(), 1).normalized();
    const double h = 4e-5;
    const auto at = [&](double steps) { return falconAngles(p_F + steps * h * way).value(); };
    const Vector3d angles_per_m = (8 * (at(1) - at(-1)) - (at(2) - at(-2))) / (12 * h);
    const double work = falconTorques(p_F, force_N)->dot(angles_per_m);
    worst = std::max(worst, std::abs(work - force_N.dot(way)) / force_N.norm());
  }
  EXPECT_LE(worst, 1e-9);
}

// At 1 kHz, sample by sample, as the driver follows a hand that draws loops as wide as the workspace.
struct Followed {
  double mean_m = 0, worst_m = 0, worst_of_counts_m = 0;
  int most_iterations = 0;
};

Followed follow(double speed_m_s) {
  Followed followed;
  Vector3d last_F = kFalconCentre_F;
  const double radius_m = 0.03;
  const int samples = 20000;
  for (int i = 0; i < samples; ++i) {
    const double turn = speed_m_s * 0.001 * i / (radius_m * std::sqrt(1.5));
    const Vector3d p_F = kFalconCentre_F +
                         radius_m * Vector3d(std::cos(turn), std::sin(turn), std::sin(turn) + 0.2 * std::sin(7 * turn));
    const Vector3d angles = falconAngles(p_F).value();
    const Vector3d counted = falconAnglesOfCounts(falconCountsOfAngles(angles));
    const FalconPlace place = falconPlace(counted, last_F);
    EXPECT_TRUE(place.reached);
    last_F = place.p_F;
    if (i > 0) followed.most_iterations = std::max(followed.most_iterations, place.iterations);
    const double error_m = (place.p_F - p_F).norm();
    followed.mean_m += error_m / samples;
    followed.worst_m = std::max(followed.worst_m, error_m);
    // The error that rounding the angles explains, to first order.
    const double explained_m = (falconJacobian(p_F)->inverse() * (counted - angles)).norm();
    followed.worst_of_counts_m = std::max(followed.worst_of_counts_m, std::abs(error_m - explained_m));
  }
  return followed;
}

TEST(FalconKinematics, AFastHandSeesTheEncodersAloneAndNoLag) {
  const Followed slow = follow(0.01), fast = follow(0.5);
  for (const Followed& one : {slow, fast}) {
    EXPECT_LT(one.worst_m, 0.060e-3);
    EXPECT_LT(one.worst_of_counts_m, 1e-6);
    EXPECT_LE(one.most_iterations, 4);
  }
  EXPECT_NEAR(fast.mean_m, slow.mean_m, 0.2 * slow.mean_m);
  RecordProperty("mean_mm", std::to_string(1e3 * fast.mean_m));
  RecordProperty("worst_mm", std::to_string(1e3 * fast.worst_m));
}

TEST(FalconKinematics, BeyondTheEdgeThereIsNoAnswerAndNeverANaN) {
  Random random(6);
  int answered = 0, none = 0, reached = 0;
  for (int i = 0; i < 60000; ++i) {
    const Vector3d p_F = random.inBox(kFalconCentre_F, i % 2 == 0 ? 0.06 : 0.2);
    const auto angles = falconAngles(p_F);
    (angles ? answered : none)++;
    if (angles) {
      ASSERT_TRUE(angles->allFinite());
    }
    const auto jacobian = falconJacobian(p_F);
    if (jacobian) {
      ASSERT_TRUE(jacobian->allFinite());
    }
    if (const auto torques = falconTorques(p_F, random.inBox(Vector3d::Zero(), 10))) {
      ASSERT_TRUE(torques->allFinite());
    }
    if (angles) {
      const FalconPlace place = falconPlace(*angles, kFalconCentre_F);
      ASSERT_TRUE(place.p_F.allFinite());
      ASSERT_LE(place.iterations, 25);
      if (place.reached) {
        ++reached;
        ASSERT_LE((falconAngles(place.p_F).value() - *angles).cwiseAbs().maxCoeff(), 1e-12);
      } else {
        ASSERT_EQ(place.p_F, kFalconCentre_F);
      }
    }
  }
  EXPECT_GT(answered, 10000);
  EXPECT_GT(none, 10000);
  EXPECT_GT(reached, 10000);
  EXPECT_FALSE(falconAngles({0, 0, 1}));
}

TEST(FalconKinematics, AnglesOfNoPlaceAreRefusedAndTheStartIsKept) {
  Random random(7);
  int refused = 0;
  for (int i = 0; i < 3000; ++i) {
    const Vector3d start_F = random.inBox(kFalconCentre_F, kFalconReach_m);
    const FalconPlace place = falconPlace(random.inBox(Vector3d::Zero(), 10), start_F);
    ASSERT_TRUE(place.p_F.allFinite());
    if (place.reached) continue;
    ++refused;
    ASSERT_EQ(place.p_F, start_F);
  }
  EXPECT_GT(refused, 1000);
  const Vector3d angles = falconAngles(kFalconCentre_F).value();
  for (const double bad : {kNaN, kInfinity, -kInfinity, 1e300}) {
    EXPECT_FALSE(falconPlace(Vector3d(angles.x(), bad, angles.z()), kFalconCentre_F).reached) << bad;
    // An unreachable start works like the centre.
    const FalconPlace place = falconPlace(angles, Vector3d(0, bad, 0.1));
    EXPECT_TRUE(place.reached) << bad;
    EXPECT_EQ(place.p_F, kFalconCentre_F);
    EXPECT_FALSE(falconAngles(Vector3d(bad, 0, 0.1))) << bad;
    EXPECT_FALSE(falconJacobian(Vector3d(0, 0, bad))) << bad;
  }
  EXPECT_FALSE(falconTorques(kFalconCentre_F, Vector3d(0, kNaN, 0)));
  EXPECT_FALSE(falconTorques(kFalconCentre_F, Vector3d(0, kInfinity, 0)));
}

TEST(FalconKinematics, CountsComeBackFromTheirAngles) {
  for (int count = -32768; count <= 32767; count += 7) {
    const auto value = static_cast<std::int16_t>(count);
    const std::array<std::int16_t, 3> counts{value, 0, 1};
    ASSERT_EQ(falconCountsOfAngles(falconAnglesOfCounts(counts)), counts);
  }
  EXPECT_NEAR(falconAnglesOfCounts({0, 0, 0}).x(), 35 * kDegree, 1e-15);
  EXPECT_NEAR((falconAnglesOfCounts({1, 0, 0}) - falconAnglesOfCounts({0, 0, 0})).x(), 0.03643 * kDegree,
              1e-5 * kDegree);
  EXPECT_EQ(falconCountsOfAngles(Vector3d(1e300, -kInfinity, kNaN)), (std::array<std::int16_t, 3>{32767, -32768, 0}));
}

TEST(FalconKinematics, MotorsHaveTheSignsOfCapturedOnes) {
  // Motor values captured from the vendor's driver, for a push along each axis. The pose and the unit are unknown, so
  // only the pattern must agree.
  struct Capture {
    Vector3d force_N, motors;
  };
  for (const Capture& capture : {Capture{{10, 0, 0}, {-679, 2529, -1862}}, Capture{{0, 10, 0}, {2481, -669, -1691}},
                                 Capture{{0, 0, -12.5}, {661, 731, 766}}, Capture{{0, 0, -25}, {1311, 1453, 1526}}}) {
    const auto motors = falconMotors(falconTorques(kFalconCentre_F, capture.force_N).value(), kFalconMotorPerNm);
    const Vector3d ours = Vector3d(motors[0], motors[1], motors[2]).normalized();
    EXPECT_GT(ours.dot(capture.motors.normalized()), 0.99) << capture.force_N.transpose();
  }
}

TEST(FalconKinematics, MotorsSaturateTogetherAndKeepTheDirection) {
  EXPECT_EQ(falconMotors(Vector3d(0.1, -0.2, 0.3), 3000), (std::array<std::int16_t, 3>{-300, 600, -900}));
  Random random(8);
  for (int i = 0; i < 20000; ++i) {
    const Vector3d torques = random.inBox(Vector3d::Zero(), std::pow(10, random.within(8)));
    const auto motors = falconMotors(torques, 2500);
    const Vector3d values(motors[0], motors[1], motors[2]);
    ASSERT_LE(values.cwiseAbs().maxCoeff(), kFalconMaxMotor);
    const Vector3d wanted = -2500 * torques;
    if (wanted.cwiseAbs().maxCoeff() > kFalconMaxMotor) {
      ASSERT_EQ(values.cwiseAbs().maxCoeff(), kFalconMaxMotor);
    }
    if (wanted.cwiseAbs().maxCoeff() > 1000) {
      ASSERT_GT(values.normalized().dot(wanted.normalized()), 1 - 1e-6);
    }
  }
  // In another driver, 3.28 N m overflowed 16 bits and changed sign.
  EXPECT_EQ(falconMotors(Vector3d(-3.3, 0, 0), 10000)[0], 4095);
  for (const Vector3d& bad : {Vector3d(kNaN, 0, 0), Vector3d(0, kInfinity, 0), Vector3d(0, 0, 1e301)})
    EXPECT_EQ(falconMotors(bad, 3000), (std::array<std::int16_t, 3>{})) << bad.transpose();
  EXPECT_EQ(falconMotors(Vector3d(0.1, 0, 0), kNaN), (std::array<std::int16_t, 3>{}));
  EXPECT_EQ(falconMotors(Vector3d(0.1, 0, 0), -3000), (std::array<std::int16_t, 3>{}));
  // Never above 1e4 a N m, for any calibration.
  EXPECT_EQ(falconMotors(Vector3d(0.1, 0, 0), 1e6), falconMotors(Vector3d(0.1, 0, 0), 1e4));
}

TEST(FalconKinematics, ATickCallsNothingThatATickMustNotCall) {
  const Vector3d angles = falconAngles(kFalconCentre_F + Vector3d(0.02, -0.01, 0.03)).value();
  test::NoAllocGuard guard;
  const FalconPlace place = falconPlace(angles, kFalconCentre_F);
  const auto motors = falconMotors(falconTorques(place.p_F, Vector3d(1, 2, 3)).value_or(Vector3d::Zero()), 3000);
  const test::ForbiddenCalls calls = guard.calls();
  EXPECT_EQ(calls.total(), 0u) << calls.first;
  EXPECT_NE(motors[0], 0);
}

}  // namespace
}  // namespace filiform
