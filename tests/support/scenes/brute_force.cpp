#include "tests/support/scenes/brute_force.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

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

std::vector<StoredSegment> storedSegments(const Tile& tile) {
  std::vector<StoredSegment> all;
  for (std::uint32_t s = 0; s < tile.segment_count(); ++s)
    all.push_back({tile.segmentId(s), tile.nodeId(tile.child(s)).sample, tile.nodeId(tile.parent(s)).sample,
                   tile.gridPoint(tile.child(s)), tile.gridPoint(tile.parent(s)), tile.owned(s)});
  return all;
}

void expectBruteForce(const TileEngine& engine, const std::vector<StoredSegment>& segments, const Grid& grid,
                      const Vector3d& h_W) {
  for (const std::size_t k : {1, 5, 50}) {
    Candidates best(k, 0, std::numeric_limits<double>::infinity());
    engine.search(h_W, best);
    engine.search(h_W, best);  // the same segments again, as if from another tile
    const auto expected = bruteForceNearest(segments, grid, h_W, k);
    const std::span<const Candidate> found = best.sorted();
    ASSERT_EQ(found.size(), expected.size());
    for (std::size_t r = 0; r < found.size(); ++r) {
      ASSERT_EQ(found[r].segment, expected[r].segment);
      ASSERT_EQ(std::sqrt(found[r].squared_distance), expected[r].distance_um);
      ASSERT_EQ(found[r].t, expected[r].t);
      ASSERT_EQ(found[r].p_W, expected[r].p_W);
    }
  }
}

}  // namespace filiform::test
