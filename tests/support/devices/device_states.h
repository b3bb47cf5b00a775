// Compares device states.
#pragma once

#include "device/haptic_device.h"

#include <bit>
#include <cstdint>
#include <cstring>

namespace filiform::test {

// Compares bits: -0 differs from 0, and a NaN equals itself.
inline bool sameBits(const DeviceState& a, const DeviceState& b) {
  const auto same = [](const Eigen::Vector3d& x, const Eigen::Vector3d& y) {
    return std::memcmp(x.data(), y.data(), 3 * sizeof(double)) == 0;
  };
  return std::bit_cast<std::uint64_t>(a.time_s) == std::bit_cast<std::uint64_t>(b.time_s) && same(a.p_D, b.p_D) &&
         same(a.v_D, b.v_D) && same(a.twist_D, b.twist_D) &&
         std::memcmp(a.orientation_D.coeffs().data(), b.orientation_D.coeffs().data(), 4 * sizeof(double)) == 0 &&
         a.buttons == b.buttons && a.status == b.status && a.sent_N.has_value() == b.sent_N.has_value() &&
         (!a.sent_N || same(*a.sent_N, *b.sent_N));
}

}  // namespace filiform::test
