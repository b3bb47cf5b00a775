// Numbers that tests of several rooms use.
#pragma once

#include <cmath>
#include <limits>
#include <random>

namespace filiform::test {

inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();
inline constexpr double kDt_s = 1e-3;  // a tick at 1 kHz

// Log-uniform: every power of ten is equally likely. Requires 0 < lo <= hi.
inline double logUniform(std::mt19937_64& random, double lo, double hi) {
  return std::exp(std::uniform_real_distribution<double>(std::log(lo), std::log(hi))(random));
}

}  // namespace filiform::test
