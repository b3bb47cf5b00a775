#include "tests/support/brute_force.h"

#include <algorithm>
#include <cmath>

namespace filiform::test {

std::vector<BruteForceResult> bruteForceNearest(const std::vector<StoredSegment>& segments, const Grid& grid,
                                                const Vector3d& h_W, std::size_t k) {
  struct Row {
    double squared;
    BruteForceResult result;
  };
  std::vector<Row> rows;
  rows.reserve(segments.size());
  for (const StoredSegment& s : segments) {
    const ClosestPoint c = closestPoint(grid.toWorld(s.child), grid.toWorld(s.parent), h_W);
    rows.push_back({c.squared_distance, {std::sqrt(c.squared_distance), s.id, c.t, c.p_W}});
  }
  const auto middle = rows.begin() + static_cast<std::ptrdiff_t>(std::min(k, rows.size()));
  std::partial_sort(rows.begin(), middle, rows.end(), [](const Row& a, const Row& b) {
    return a.squared != b.squared ? a.squared < b.squared : a.result.segment < b.result.segment;
  });
  std::vector<BruteForceResult> results;
  for (auto row = rows.begin(); row != middle; ++row) results.push_back(row->result);
  return results;
}

}  // namespace filiform::test
