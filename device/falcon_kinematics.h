// Kinematics and statics of the Novint Falcon, a delta robot of three legs: arm angles to the place of the grip and
// back, forces at the grip to torques at the arms, counts and motor values to both. No input gives a NaN: what has no
// answer has none.
//
// Frame F: metres, axes as frame D (x right, y up, z towards the person), origin in the middle of the motors; D's
// origin is kFalconCentre_F. Motors are numbered 0 top, 1 right, 2 left, seen by the person. Angles in radians, 0 where
// the arm stands square to the device's axis, growing as the grip comes out. Thread rule: functions without state, any
// thread, haptic-safe: noexcept, no allocation.
//
// Accuracy, asserted by the tests over the whole workspace: forward of inverse within 1e-12 m; at most 9 iterations
// from kFalconCentre_F, 14 from anywhere, 4 from the place of a millisecond ago; the Jacobian within 1e-9 of central
// differences, relative. A count of the encoders is 0.03 to 0.06 mm.
// Source: the delta mechanism of Stamper and Tsai; dimensions measured on the device by others.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include <Eigen/Core>

namespace filiform {

// Middle of what the mechanism reaches, and half of the box about it in which every place can be reached.
inline const Eigen::Vector3d kFalconCentre_F{0, 0, 0.120};
inline constexpr double kFalconReach_m = 0.04;

// Of the legs that place the grip at `p_F`; none where it cannot get, or its parts would have to pass through each
// other, or p_F is not finite.
std::optional<Eigen::Vector3d> falconAngles(const Eigen::Vector3d& p_F) noexcept;

// d(angles)/dp, rad/m. None where the angles have none, and at the edge of the workspace, where an arm and its shin are
// in line and the grip cannot be held.
std::optional<Eigen::Matrix3d> falconJacobian(const Eigen::Vector3d& p_F) noexcept;

struct FalconPlace {
  Eigen::Vector3d p_F = kFalconCentre_F;
  int iterations = 0;
  bool reached = false;  // the angles at p_F are those asked for, to 1e-12 rad
};

// Where the grip is: Newton's method from `start_F`, the place of the sample before (a start that is no place of the
// grip counts as kFalconCentre_F). Where the angles belong to no place, are not finite, or 25 iterations do not do,
// `reached` is false and p_F is the start.
FalconPlace falconPlace(const Eigen::Vector3d& angles_rad, const Eigen::Vector3d& start_F) noexcept;

// Torques at the arms (N m) that make the grip at p_F push with that force: tau = (dp/dangles)^T F, so the work is the
// same on both sides. None where there is no Jacobian, or the force is not finite.
std::optional<Eigen::Vector3d> falconTorques(const Eigen::Vector3d& p_F, const Eigen::Vector3d& force_N) noexcept;

// Encoders: 1280 counts a turn of the motor, 7.72 turns of the motor for one of the arm; 0 at 35 degrees after homing.
Eigen::Vector3d falconAnglesOfCounts(const std::array<std::int16_t, 3>& counts) noexcept;
// Nearest counts; angles beyond the range of a count saturate.
std::array<std::int16_t, 3> falconCountsOfAngles(const Eigen::Vector3d& angles_rad) noexcept;

inline constexpr int kFalconMaxMotor = 4095;
// Motor values for a torque of 1 N m at an arm. Nobody has published the motors' constant: this guess is on the weak
// side, and device/HARDWARE.md says how to calibrate it.
inline constexpr double kFalconMotorPerNm = 3000;
inline constexpr double kFalconMotorPerNmMost = 10000;

// Motor values for torques at the arms. Where one would exceed +-kFalconMaxMotor all three are made smaller by the same
// factor, so that the force keeps its direction. Torques that are not finite give zeros; motor_per_Nm is limited to
// 0..kFalconMotorPerNmMost.
std::array<std::int16_t, 3> falconMotors(const Eigen::Vector3d& torques_Nm, double motor_per_Nm) noexcept;
// What part of the torques the motors are told so, 0 to 1: less than 1 where values are limited.
double falconMotorShare(const Eigen::Vector3d& torques_Nm, double motor_per_Nm) noexcept;

}  // namespace filiform
