// The order of points along the space-filling curve of tile ids. Functions without state.
#pragma once

#include "index/geometry/grid.h"

#include <cstddef>
#include <span>
#include <vector>

namespace filiform {

// Positions in `points`, ordered by Morton key, then by position. Consecutive points of this order mostly need the same
// tiles. Points beyond the grid count as on its edge. Requires finite coordinates. O(n log n).
std::vector<std::size_t> curveOrder(const Grid& grid, std::span<const Vector3d> points_W);

}  // namespace filiform
