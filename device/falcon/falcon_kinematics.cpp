#include "device/falcon/falcon_kinematics.h"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

namespace filiform {
namespace {

// Metres, named as in Stamper's thesis: thigh a, shin b, plates c, d, e, hinge f, and the thigh's axis (r, s).
constexpr double kA = 0.060, kB = 0.1025, kC = 0.01443, kD = 0.01125, kE = 0.01125, kF = -0.025;
constexpr double kR = 0.040, kS = -0.02309;
constexpr double kDegree = 3.14159265358979323846 / 180;
constexpr std::array<double, 3> kLeg_rad{105 * kDegree, -15 * kDegree, -135 * kDegree};

constexpr double kCountsPerTurn = 1280, kGear = 110.0 / 14.25;
constexpr double kRadPerCount = 360 * kDegree / (kCountsPerTurn * kGear);
constexpr double kRadAtZero = 35 * kDegree;

constexpr int kMostIterations = 25, kMostHalvings = 20, kHalvingsToBeNearer = 6;
constexpr double kStep_m = 0.020;
constexpr double kAngleTolerance_rad = 1e-12;
constexpr double kLeastSine = 1e-6;  // of the angle between arm and shin, and of the shin: at the edge

struct Leg {
  double angle_rad;                      // theta 1
  double sin2, cos2, sin3, cos3, sin21;  // of theta 2, theta 3, theta 2 - theta 1
};

std::optional<Leg> legAt(const Eigen::Vector3d& p_F, double cos_phi, double sin_phi) noexcept {
  const double u = cos_phi * p_F.x() + sin_phi * p_F.y() - kR;
  const double v = -sin_phi * p_F.x() + cos_phi * p_F.y() - kS;
  const double w = p_F.z();
  Leg leg{};
  leg.cos3 = (v + kF) / kB;
  if (!(std::abs(leg.cos3) < 1)) return std::nullopt;
  leg.sin3 = std::sqrt((1 - leg.cos3) * (1 + leg.cos3));
  // The rest is a planar chain of two bars, a and `shin`, from the origin to (reach_u, w).
  const double shin = kD + kE + kB * leg.sin3;
  const double reach_u = u + kC;
  const double reach = std::hypot(reach_u, w);
  const double cosine = (reach * reach + kA * kA - shin * shin) / (2 * kA * reach);
  if (!(std::abs(cosine) <= 1)) return std::nullopt;
  leg.angle_rad = std::atan2(w, reach_u) - std::acos(cosine);
  const double sin1 = std::sin(leg.angle_rad), cos1 = std::cos(leg.angle_rad);
  leg.sin2 = (w - kA * sin1) / shin;
  leg.cos2 = (reach_u - kA * cos1) / shin;
  leg.sin21 = leg.sin2 * cos1 - leg.cos2 * sin1;
  return leg;
}

struct LegFrame {
  double cos_phi, sin_phi;
};

const std::array<LegFrame, 3> kLegFrames = [] {
  std::array<LegFrame, 3> frames{};
  for (std::size_t i = 0; i < 3; ++i) frames[i] = {std::cos(kLeg_rad[i]), std::sin(kLeg_rad[i])};
  return frames;
}();

struct Pose {
  Eigen::Vector3d angles_rad;
  std::array<Leg, 3> legs;
};

std::optional<Pose> poseAt(const Eigen::Vector3d& p_F) noexcept {
  if (!p_F.allFinite()) return std::nullopt;
  Pose pose;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::optional<Leg> leg = legAt(p_F, kLegFrames[i].cos_phi, kLegFrames[i].sin_phi);
    if (!leg) return std::nullopt;
    pose.legs[i] = *leg;
    pose.angles_rad[static_cast<Eigen::Index>(i)] = leg->angle_rad;
  }
  return pose;
}

std::optional<Eigen::Matrix3d> jacobianOf(const Pose& pose) noexcept {
  Eigen::Matrix3d jacobian;
  for (std::size_t i = 0; i < 3; ++i) {
    const Leg& leg = pose.legs[i];
    const auto [cos_phi, sin_phi] = kLegFrames[i];
    if (!(leg.sin21 > kLeastSine && leg.sin3 > kLeastSine)) return std::nullopt;
    jacobian.row(static_cast<Eigen::Index>(i)) =
        Eigen::RowVector3d(leg.cos2 * leg.sin3 * cos_phi - leg.cos3 * sin_phi,
                           leg.cos2 * leg.sin3 * sin_phi + leg.cos3 * cos_phi, leg.sin2 * leg.sin3) /
        (kA * leg.sin3 * leg.sin21);
  }
  return jacobian;
}

}  // namespace

std::optional<Eigen::Vector3d> falconAngles(const Eigen::Vector3d& p_F) noexcept {
  const std::optional<Pose> pose = poseAt(p_F);
  if (!pose) return std::nullopt;
  return pose->angles_rad;
}

std::optional<Eigen::Matrix3d> falconJacobian(const Eigen::Vector3d& p_F) noexcept {
  const std::optional<Pose> pose = poseAt(p_F);
  return pose ? jacobianOf(*pose) : std::nullopt;
}

FalconPlace falconPlace(const Eigen::Vector3d& angles_rad, const Eigen::Vector3d& start_F) noexcept {
  FalconPlace place;
  place.p_F = start_F;
  std::optional<Pose> pose = poseAt(start_F);
  std::optional<Eigen::Matrix3d> jacobian = pose ? jacobianOf(*pose) : std::nullopt;
  if (!jacobian) {
    place.p_F = kFalconCentre_F;
    pose = poseAt(kFalconCentre_F);
    jacobian = jacobianOf(*pose);
  }
  if (!angles_rad.allFinite()) return place;
  Eigen::Vector3d p_F = place.p_F;
  while (true) {
    const Eigen::Vector3d miss_rad = angles_rad - pose->angles_rad;
    if (miss_rad.cwiseAbs().maxCoeff() <= kAngleTolerance_rad) {
      place.p_F = p_F;
      place.reached = true;
      return place;
    }
    if (place.iterations == kMostIterations) return place;
    ++place.iterations;
    // A full step from far away would leave the domain. Near its edge, where the angles curve, it would overshoot.
    Eigen::Vector3d step_m = jacobian->inverse() * miss_rad;
    if (const double length_m = step_m.norm(); !(length_m <= kStep_m)) step_m *= kStep_m / length_m;
    for (int halvings = 0;; ++halvings) {
      pose = poseAt(p_F + step_m);
      jacobian = pose ? jacobianOf(*pose) : std::nullopt;
      const bool nearer = jacobian && (angles_rad - pose->angles_rad).norm() < miss_rad.norm();
      if (nearer || (jacobian && halvings >= kHalvingsToBeNearer)) break;
      if (halvings == kMostHalvings) return place;
      step_m *= 0.5;
    }
    p_F += step_m;
  }
}

std::optional<Eigen::Vector3d> falconTorques(const Eigen::Vector3d& p_F, const Eigen::Vector3d& force_N) noexcept {
  const std::optional<Eigen::Matrix3d> jacobian = falconJacobian(p_F);
  if (!jacobian || !force_N.allFinite()) return std::nullopt;
  const Eigen::Vector3d torques_Nm = jacobian->transpose().inverse() * force_N;
  if (!torques_Nm.allFinite()) return std::nullopt;
  return torques_Nm;
}

Eigen::Vector3d falconAnglesOfCounts(const std::array<std::int16_t, 3>& counts) noexcept {
  return Eigen::Vector3d(counts[0], counts[1], counts[2]) * kRadPerCount + Eigen::Vector3d::Constant(kRadAtZero);
}

std::array<std::int16_t, 3> falconCountsOfAngles(const Eigen::Vector3d& angles_rad) noexcept {
  std::array<std::int16_t, 3> counts{};
  for (std::size_t i = 0; i < 3; ++i) {
    const double count = (angles_rad[static_cast<Eigen::Index>(i)] - kRadAtZero) / kRadPerCount;
    if (!std::isnan(count)) counts[i] = static_cast<std::int16_t>(std::lround(std::clamp(count, -32768.0, 32767.0)));
  }
  return counts;
}

std::array<std::int16_t, 3> falconMotors(const Eigen::Vector3d& torques_Nm, double motor_per_Nm) noexcept {
  if (!torques_Nm.allFinite() || !(motor_per_Nm > 0)) return {};
  // A positive motor value pulls the arm in, against the angle.
  const Eigen::Vector3d wanted = -std::min(motor_per_Nm, kFalconMotorPerNmMost) * torques_Nm;
  const double most = wanted.cwiseAbs().maxCoeff();
  if (!(most <= 1e100)) return {};
  const Eigen::Vector3d values = most > kFalconMaxMotor ? Eigen::Vector3d(wanted * (kFalconMaxMotor / most)) : wanted;
  std::array<std::int16_t, 3> motors{};
  for (std::size_t i = 0; i < 3; ++i)
    motors[i] = static_cast<std::int16_t>(std::lround(values[static_cast<Eigen::Index>(i)]));
  return motors;
}

double falconMotorShare(const Eigen::Vector3d& torques_Nm, double motor_per_Nm) noexcept {
  if (!torques_Nm.allFinite() || !(motor_per_Nm > 0)) return 0;
  const double most = std::min(motor_per_Nm, kFalconMotorPerNmMost) * torques_Nm.cwiseAbs().maxCoeff();
  if (!(most <= 1e100)) return 0;
  return most > kFalconMaxMotor ? kFalconMaxMotor / most : 1.0;
}

}  // namespace filiform
