// Angles without libm, so that every processor gives the same bits. Thread rule: pure functions.
#pragma once

#include "index/geometry/grid.h"

namespace filiform::internal {

// The angle between two vectors, 0 to pi; 0 if one of them is 0. Error below 4e-16 rad, plus that of the products.
double angleBetween_rad(const Vector3d& u, const Vector3d& v);

}  // namespace filiform::internal
