#include "index/measure/internal/principal_axes.h"

#include <cmath>

namespace filiform::internal {

// Jacobi's rotations. Each sweep about squares what is left beside the diagonal; 3x3 need at most 6.
Eigen::Matrix3d eigenvectors(Eigen::Matrix3d a) {
  Eigen::Matrix3d v = Eigen::Matrix3d::Identity();
  for (int sweep = 0; sweep < 12; ++sweep) {
    for (int p = 0; p < 2; ++p)
      for (int q = p + 1; q < 3; ++q) {
        if (a(p, q) == 0) continue;
        const double theta = (a(q, q) - a(p, p)) / (2 * a(p, q));
        const double t = (theta < 0 ? -1 : 1) / (std::abs(theta) + std::sqrt(theta * theta + 1));
        const double c = 1 / std::sqrt(t * t + 1), s = t * c;
        for (int k = 0; k < 3; ++k) {
          const double x = a(k, p), y = a(k, q);
          a(k, p) = c * x - s * y, a(k, q) = s * x + c * y;
        }
        for (int k = 0; k < 3; ++k) {
          const double x = a(p, k), y = a(q, k);
          a(p, k) = c * x - s * y, a(q, k) = s * x + c * y;
        }
        a(p, q) = a(q, p) = 0;
        for (int k = 0; k < 3; ++k) {
          const double x = v(k, p), y = v(k, q);
          v(k, p) = c * x - s * y, v(k, q) = s * x + c * y;
        }
      }
    if (a(0, 1) == 0 && a(0, 2) == 0 && a(1, 2) == 0) break;
  }
  return v;
}

}  // namespace filiform::internal
