#include "index/ingest/tiling/internal/leaf_builder.h"

#include "index/errors.h"

#include <gtest/gtest.h>

namespace filiform::internal {
namespace {

constexpr std::int64_t kCell = 1024;  // grid points along the edge of the leaves near the origin
constexpr std::uint32_t kShort = 30, kLong = 100;

// Leaves along the x axis, each with kShort segments. kLong segments of one cell cross all of them, with midpoints in
// the middle leaf.
class LongSegments : public ::testing::Test {
 protected:
  LongSegments() : own_(spool_), too_long_(spool_) {
    std::vector<MortonKey> keys;
    for (std::int64_t leaf = -50; leaf < 50; ++leaf)
      for (std::uint32_t i = 0; i < kShort; ++i) {
        const GridPoint p(leaf * kCell + 100, 100, 100), q(leaf * kCell + 200 + i, 200, 200);
        keys.push_back(mortonKey(midpoint(p, q)));
        if (leaf == 0) own_.add({{0, i}, i, i + 1, p, q, 1.0f, 3});
      }
    for (std::uint32_t i = 0; i < kLong; ++i)
      own_.add(
          {{1, i}, i, i + 1000, GridPoint(-49 * kCell, 150, 150), GridPoint(49 * kCell + 600, 150 + i, 150), 1, 3});
    own_.close();
    std::sort(keys.begin(), keys.end());
    partition_ = Partition::split(keys, kShort);
    leaf_ = partition_.home({150, 150, 150});
  }
  LeafBuilder builder(std::vector<std::size_t>& stored) {
    return LeafBuilder(partition_, spool_, too_long_, kShort,
                       [&stored](LeafContent& content) { stored.push_back(content.segments.size()); });
  }
  Spool spool_{"", std::size_t{4} << 10, 0};
  SegmentChain own_, too_long_;
  Partition partition_{std::vector<BlockKey>{BlockKey{}}};
  std::uint32_t leaf_ = 0;
};

TEST_F(LongSegments, AreCountedApart) {
  std::vector<std::size_t> stored;
  SegmentChain* const chain = &own_;
  const LeafBuilder::Counts counts = builder(stored).count({&chain, 1}, {leaf_, leaf_ + 1, partition_.leaves()[leaf_]});
  EXPECT_EQ(counts.stored, std::vector<std::uint32_t>{kShort});
  EXPECT_EQ(counts.too_long, std::vector<std::uint32_t>{kLong});
}

// They are not part of the tile that is built.
TEST_F(LongSegments, DoNotMakeATileTooLarge) {
  std::vector<std::size_t> stored;
  SegmentChain* const chain = &own_;
  MemoryBudget budget(LeafBuilder::tileCost(kShort + 10), 1);
  MemoryBudget::Hold hold(budget);
  LeafBuilder made = builder(stored);
  made.memoryFor = [](std::uint64_t bytes) { return bytes; };
  made.build({&chain, 1}, {leaf_, leaf_ + 1, partition_.leaves()[leaf_]}, hold);
  EXPECT_EQ(stored, std::vector<std::size_t>{kShort});
  too_long_.close();
  EXPECT_EQ(too_long_.count(), kLong);
}

}  // namespace
}  // namespace filiform::internal
