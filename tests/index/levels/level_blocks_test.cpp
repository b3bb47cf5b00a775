#include "index/levels/internal/level_blocks.h"

#include <algorithm>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace filiform::internal {
namespace {

constexpr std::uint64_t kLeast = 1000;

// Leaves of one depth, filled from the first key on. Blocks hold different numbers of segments.
struct Octree {
  Octree(std::uint64_t seed, int depth, std::size_t count, std::uint32_t most) {
    std::mt19937_64 random(seed);
    for (std::size_t i = 0; i < count; ++i) {
      leaves.push_back({static_cast<MortonKey>(i) << (kMortonBits - depth), depth});
      segments.push_back(1 + static_cast<std::uint32_t>(random() % most));
    }
  }
  std::vector<BlockKey> leaves;
  std::vector<std::uint32_t> segments;
};

struct Found {
  std::uint64_t largest_first = 0;
  int levels = 0, between_steps = 0;
};

void look(const LevelBlocks& blocks, const LeafRange& range, Found& found) {
  if (range.end - range.begin == 1) return;
  const BlockKey block = blocks.block(range);
  if (blocks.hasLevel(range, block)) {
    ++found.levels;
    if (block.depth % 6 != 0 && !blocks.isOutermost(range)) ++found.between_steps;
    if (blocks.isFirst(range)) found.largest_first = std::max(found.largest_first, blocks.segments(range));
  }
  for (std::size_t at = range.begin; at < range.end;) {
    const LeafRange inside = blocks.part(at, range.end, block.depth);
    look(blocks, inside, found);
    at = inside.end;
  }
}

// The neurites of a first block are in memory at once.
TEST(LevelBlocks, AFirstBlockHoldsLessThanSixteenTimesTheLeastSegments) {
  int between_steps = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const auto most = static_cast<std::uint32_t>(10 + 25 * (seed % 39));
    const Octree octree(seed, 18, 20000 + 3000 * seed, most);
    const LevelBlocks blocks(octree.leaves, octree.segments, kLeast);
    Found found;
    look(blocks, {0, octree.leaves.size()}, found);
    EXPECT_GT(found.levels, 1);
    EXPECT_LT(found.largest_first, 16 * kLeast);
    between_steps += found.between_steps;
  }
  EXPECT_GT(between_steps, 0);
}

}  // namespace
}  // namespace filiform::internal
