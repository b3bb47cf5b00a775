#include "index/query/curve_order.h"

#include "index/geometry/partition.h"

#include <algorithm>
#include <utility>

namespace filiform {

std::vector<std::size_t> curveOrder(const Grid& grid, std::span<const Vector3d> points_W) {
  constexpr double kEdge = Grid::kMaxCoordinate_um;
  std::vector<std::pair<MortonKey, std::size_t>> keys;
  keys.reserve(points_W.size());
  for (const Vector3d& p_W : points_W)
    keys.emplace_back(mortonKey(grid.snap(p_W.cwiseMax(-kEdge).cwiseMin(kEdge))), keys.size());
  std::sort(keys.begin(), keys.end());
  std::vector<std::size_t> order;
  order.reserve(keys.size());
  for (const auto& [key, position] : keys) order.push_back(position);
  return order;
}

}  // namespace filiform
