#include "tools/lab/evaluate/trials/segment_tree.h"

#include "tests/lab/evaluation_cells.h"
#include "tools/lab/evaluate/trials/trial_cell.h"

#include <limits>
#include <random>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

TEST(SegmentTree, FindsTheDistanceThatBruteForceFinds) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(seed);
    TrialCell cell(test::randomTree(seed, 500));
    const CellGraph& graph = cell.graph();
    const SegmentTree& tree = cell.tree(0);
    std::mt19937_64 random(seed);
    for (int i = 0; i < 200; ++i) {
      const auto uniform = [&] { return 100 * (static_cast<double>(random() >> 11) * 0x1p-53 - 0.5); };
      const Vector3d h_W(uniform(), uniform(), uniform());
      double least = std::numeric_limits<double>::infinity();
      for (std::uint32_t rank = 1; rank < graph.samples(); ++rank)
        least = std::min(
            least, closestPoint(graph.position_W(rank), graph.position_W(graph.parents[rank]), h_W).squared_distance);
      const SegmentTree::Found found = tree.nearest(h_W, std::numeric_limits<double>::infinity());
      EXPECT_EQ(found.point.squared_distance, least);
      EXPECT_LE(found.tested, graph.samples());
      EXPECT_EQ(tree.nearest(h_W, least).segment, SegmentTree::kNone) << "none is strictly nearer";
    }
  }
}

TEST(SegmentTree, KnowsOnlyItsOwnTree) {
  TrialCell cell(test::cellOf({{0, 0, 0}, {10, 0, 0}, {0, 1, 0}, {10, 1, 0}}, {kNoParent, 0, kNoParent, 2}));
  const double far = std::numeric_limits<double>::infinity();
  EXPECT_EQ(cell.tree(0).nearest({5, 1, 0}, far).segment, 1u);
  EXPECT_EQ(cell.tree(2).nearest({5, 0, 0}, far).segment, 3u);
}

}  // namespace
}  // namespace filiform::tools
