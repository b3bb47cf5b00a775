#include "index/measure/internal/angle.h"

#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

namespace filiform::internal {
namespace {

// Of 0 <= t <= 1: two halvings of the angle, then the series at most at 0.199, where the first term left out is 4e-18.
double arcTangent(double t) {
  for (int i = 0; i < 2; ++i) t /= 1 + std::sqrt(1 + t * t);
  const double t2 = t * t;
  double sum = 0;
  for (int k = 11; k >= 0; --k) sum = 1.0 / (2 * k + 1) - t2 * sum;
  return 4 * t * sum;
}

}  // namespace

double angleBetween_rad(const Vector3d& u, const Vector3d& v) {
  const double y = u.cross(v).norm(), x = u.dot(v), width = std::abs(x);
  if (y == 0 && x == 0) return 0;
  const double acute = y > width ? std::numbers::pi / 2 - arcTangent(width / y) : arcTangent(y / width);
  return x < 0 ? std::numbers::pi - acute : acute;
}

}  // namespace filiform::internal
