#include "device/vector_length.h"

#include <array>
#include <cstring>
#include <limits>
#include <random>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using Eigen::Vector3d;

TEST(VectorLength, IsWithinTwoUlpOfTheExactOne) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> part(-1, 1), exponent(-290, 300);
  for (int i = 0; i < 20000; ++i) {
    const Vector3d v = std::pow(10.0, exponent(random)) * Vector3d(part(random), part(random), part(random));
    const auto x = static_cast<long double>(v.x()), y = static_cast<long double>(v.y()),
               z = static_cast<long double>(v.z());
    const auto exact = static_cast<double>(std::sqrt(x * x + y * y + z * z));
    EXPECT_NEAR(lengthOf(v), exact, 3 * std::numeric_limits<double>::epsilon() * exact) << v.transpose();
  }
}

TEST(VectorLength, HasTheSameBitsAtEveryAddress) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> part(-1, 1);
  alignas(64) std::array<double, 8> room{};
  for (int i = 0; i < 2000; ++i) {
    const Vector3d v(part(random), part(random), part(random));
    for (std::size_t at = 0; at < 5; ++at) {
      std::memcpy(room.data() + at, v.data(), sizeof v);
      EXPECT_EQ(lengthOf(Eigen::Map<const Vector3d>(room.data() + at)), lengthOf(v));
    }
  }
}

TEST(VectorLength, ExtremesGiveNoFalseLength) {
  constexpr double kMost = std::numeric_limits<double>::max(), kInfinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(lengthOf(Vector3d::Zero()), 0);
  EXPECT_NEAR(lengthOf({kMost, 0, 0}) / kMost, 1, 1e-14);
  EXPECT_EQ(lengthOf({3e300, 4e300, 0}), 5e300);
  EXPECT_EQ(lengthOf({kMost, kMost, 0}), kInfinity);
  EXPECT_EQ(lengthOf({std::numeric_limits<double>::quiet_NaN(), 1, 1}), kInfinity);
  EXPECT_EQ(lengthOf({1, kInfinity, 1}), kInfinity);
  EXPECT_EQ(lengthOf({0, 5e-324, 0}), 5e-324);
}

}  // namespace
}  // namespace filiform
