// Kinematics and statics of the Novint Falcon, a delta robot with three legs. Converts arm angles to grip position and
// back, grip forces to arm torques, and both to encoder counts and motor values. No function returns NaN: without a
// solution it returns nullopt.
//
// Frame F: metres; axes as frame D (x right, y up, z towards the person); origin at the middle of the motors. D's
// origin is kFalconCentre_F. Motors are numbered 0 top, 1 right, 2 left, as the person sees them. Angles are in
// radians: 0 if the arm is perpendicular to the device's axis, growing as the grip comes out. Thread rule: functions
// without state, any thread, also the haptic one (noexcept, no allocation).
//
// Accuracy, tested over the whole workspace:
//   forward of inverse   within 1e-12 m
//   iterations           at most 9 from kFalconCentre_F, 14 from anywhere, 4 from the position 1 ms earlier
//   Jacobian             within a relative 1e-9 of central differences
// One encoder count is 0.03 to 0.06 mm. Source: the delta mechanism of Stamper and Tsai; dimensions as others measured
// them on the device.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include <Eigen/Core>

namespace filiform {

// Middle of the reachable space, and half the edge of a box around it in which every position is reachable.
inline const Eigen::Vector3d kFalconCentre_F{0, 0, 0.120};
inline constexpr double kFalconReach_m = 0.04;

// Arm angles, rad, for the grip at p_F. nullopt if the position is unreachable, would make parts collide, or is not
// finite.
std::optional<Eigen::Vector3d> falconAngles(const Eigen::Vector3d& p_F) noexcept;

// d(angles)/dp, rad/m. nullopt where falconAngles() has none, and at the edge of the workspace. There an arm and its
// shin are in line and cannot hold the grip.
std::optional<Eigen::Matrix3d> falconJacobian(const Eigen::Vector3d& p_F) noexcept;

// Result of falconPlace().
struct FalconPlace {
  Eigen::Vector3d p_F = kFalconCentre_F;
  int iterations = 0;
  bool reached = false;  // true: p_F has the given angles within 1e-12 rad
};

// Position of the grip for given angles, by Newton's method from `start_F`, the previous position. An unreachable start
// is replaced by kFalconCentre_F. `reached` is false, and p_F is the start, if no position has these angles, if they
// are not finite, or after 25 iterations.
FalconPlace falconPlace(const Eigen::Vector3d& angles_rad, const Eigen::Vector3d& start_F) noexcept;

// Arm torques, N m, with which the grip at p_F exerts `force_N`: tau = (dp/dangles)^T F, which conserves work. nullopt
// if there is no Jacobian or the force is not finite.
std::optional<Eigen::Vector3d> falconTorques(const Eigen::Vector3d& p_F, const Eigen::Vector3d& force_N) noexcept;

// Encoder angles: 1280 counts a motor turn, 7.72 motor turns an arm turn; 0 counts are 35 degrees after homing.
Eigen::Vector3d falconAnglesOfCounts(const std::array<std::int16_t, 3>& counts) noexcept;
// The nearest counts; angles out of range saturate.
std::array<std::int16_t, 3> falconCountsOfAngles(const Eigen::Vector3d& angles_rad) noexcept;

inline constexpr int kFalconMaxMotor = 4095;
// Motor value for 1 N m at an arm. No published value exists; this guess is low on purpose. HARDWARE.md explains the
// calibration.
inline constexpr double kFalconMotorPerNm = 3000;
inline constexpr double kFalconMotorPerNmMost = 10000;

// Motor values for arm torques. If one would exceed +-kFalconMaxMotor, all three are reduced by the same factor, which
// keeps the force's direction. Torques that are not finite give zeros. motor_per_Nm is clamped to
// 0..kFalconMotorPerNmMost.
std::array<std::int16_t, 3> falconMotors(const Eigen::Vector3d& torques_Nm, double motor_per_Nm) noexcept;
// The fraction of the torques that falconMotors() applies, 0 to 1; below 1 if values are limited.
double falconMotorShare(const Eigen::Vector3d& torques_Nm, double motor_per_Nm) noexcept;

}  // namespace filiform
