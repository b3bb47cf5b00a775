// The length of a vector whose square may overflow. Eigen's stableNorm() depends on the address of the vector: it
// begins a new sum where 16 bytes are aligned, so the last bit differs between builds. Thread rule: a pure function.
#pragma once

#include <cmath>
#include <limits>

#include <Eigen/Core>

namespace filiform {

// The same bits on every machine. Infinite if the vector is not finite, or so long that the sum of its parts overflows.
inline double lengthOf(const Eigen::Vector3d& v) noexcept {
  const double x = std::abs(v.x()), y = std::abs(v.y()), z = std::abs(v.z());
  if (!(x + y + z <= std::numeric_limits<double>::max())) return std::numeric_limits<double>::infinity();
  const double largest = x > y ? (x > z ? x : z) : (y > z ? y : z);
  const double share = 1 / largest;
  if (!(share <= std::numeric_limits<double>::max())) return largest;  // 0, or too small to matter
  const double a = x * share, b = y * share, c = z * share;
  return largest * std::sqrt((a * a + b * b) + c * c);
}

}  // namespace filiform
