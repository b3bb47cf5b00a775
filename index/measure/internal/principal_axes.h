// Principal axes of points. Thread rule: pure functions.
#pragma once

#include "index/geometry/grid.h"

#include <Eigen/Core>

namespace filiform::internal {

// The eigenvectors of a symmetric matrix, as columns, in no order. Without libm: every processor gives the same bits.
Eigen::Matrix3d eigenvectors(Eigen::Matrix3d symmetric);

}  // namespace filiform::internal
