#include "index/levels/internal/level_blocks.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace filiform::internal {
namespace {

constexpr int kOctree = 3;    // binary splits
constexpr int kStepBits = 6;  // between the blocks of level tiles
constexpr std::uint64_t kTimesInside = 4;
// A block between the steps has a level from so many times the least number of segments on, unless levels lie inside.
// Hence a first block holds less than 8 times this number, and fits in memory.
constexpr std::uint64_t kTimesCrowded = 2;

BlockKey prefixOf(MortonKey key, int depth) { return {key & ~((MortonKey{1} << (kMortonBits - depth)) - 1), depth}; }

// Walks down the octree; each leaf gets the tolerance of the last block with a level.
class ToleranceWalk {
 public:
  ToleranceWalk(const LevelBlocks& blocks, const Grid& grid, const GridBox& bounds)
      : blocks_(blocks), grid_(grid), bounds_(bounds), by_leaf_(blocks.size(), 0) {}

  std::vector<float> run() {
    if (blocks_.size() > 1) enter({0, blocks_.size()}, 0);
    return std::move(by_leaf_);
  }

 private:
  GridBox contentOf(const LeafRange& range) const {
    GridBox content;
    for (std::size_t i = range.begin; i < range.end; ++i) content.extend(blocks_.leaf(i).box());
    content.lo = content.lo.cwiseMax(bounds_.lo);
    content.hi = content.hi.cwiseMin(bounds_.hi);
    return content;
  }
  void enter(const LeafRange& range, float tolerance_um) {
    if (range.end - range.begin == 1) {
      by_leaf_[range.begin] = tolerance_um;
      return;
    }
    const BlockKey block = blocks_.block(range);
    if (blocks_.hasLevel(range, block))
      tolerance_um = static_cast<float>(extentOf_um(block, contentOf(range), grid_) /
                                        (blocks_.isFirst(range) ? kFirstParts : kParts));
    for (std::size_t at = range.begin; at < range.end;) {
      const LeafRange part = blocks_.part(at, range.end, block.depth);
      enter(part, tolerance_um);
      at = part.end;
    }
  }

  const LevelBlocks& blocks_;
  const Grid& grid_;
  const GridBox& bounds_;
  std::vector<float> by_leaf_;
};

}  // namespace

LevelBlocks::LevelBlocks(std::span<const BlockKey> leaves, std::span<const std::uint32_t> segments,
                         std::uint64_t least_segments)
    : leaves_(leaves), least_(least_segments) {
  before_.reserve(leaves.size() + 1);
  before_.push_back(0);
  for (const std::uint32_t n : segments) before_.push_back(before_.back() + n);
}

BlockKey LevelBlocks::tightBlock(const LeafRange& range) const {
  if (range.end - range.begin == 1) return leaves_[range.begin];
  const MortonKey differ = leaves_[range.begin].low ^ leaves_[range.end - 1].low;
  const auto high = static_cast<std::uint64_t>(differ >> 64), low = static_cast<std::uint64_t>(differ);
  const int zeros = high != 0 ? std::countl_zero(high) : 64 + std::countl_zero(low);
  return prefixOf(leaves_[range.begin].low, std::max(0, zeros - (128 - kMortonBits)));
}

BlockKey LevelBlocks::block(const LeafRange& range) const {
  const BlockKey tight = tightBlock(range);
  return prefixOf(tight.low, tight.depth / kOctree * kOctree);
}

LeafRange LevelBlocks::part(std::size_t begin, std::size_t end, int depth) const {
  if (leaves_[begin].depth < depth + kOctree) return {begin, begin + 1};
  const int shift = kMortonBits - depth - kOctree;
  std::size_t at = begin + 1;
  while (at < end && leaves_[at].low >> shift == leaves_[begin].low >> shift) ++at;
  return {begin, at};
}

bool LevelBlocks::hasLevel(const LeafRange& range, const BlockKey& block) const {
  return isOutermost(range) || hasLevel(range, block, largestInside(range));
}

bool LevelBlocks::hasLevel(const LeafRange& range, const BlockKey& block, std::uint64_t largest_inside) const {
  if (block.depth % kStepBits == 0) return segments(range) >= std::max(least_, kTimesInside * largest_inside);
  return largest_inside == 0 && segments(range) >= kTimesCrowded * least_;
}

std::uint64_t LevelBlocks::largestInside(const LeafRange& range) const {
  std::uint64_t largest = 0;
  const BlockKey outer = block(range);
  for (std::size_t at = range.begin; at < range.end;) {
    const LeafRange inside = part(at, range.end, outer.depth);
    at = inside.end;
    if (inside.end - inside.begin == 1 || segments(inside) < least_) continue;
    const std::uint64_t of_inside = largestInside(inside);
    largest = std::max(largest, hasLevel(inside, block(inside), of_inside) ? segments(inside) : of_inside);
  }
  return largest;
}

std::vector<float> leafTolerances_um(std::span<const BlockKey> leaves, std::span<const std::uint32_t> segments,
                                     std::uint64_t least_segments, const Grid& grid, const GridBox& bounds) {
  std::vector<BlockKey> filled;
  std::vector<std::uint32_t> filled_segments;
  for (std::size_t i = 0; i < leaves.size(); ++i) {
    if (segments[i] == 0) continue;
    filled.push_back(leaves[i]);
    filled_segments.push_back(segments[i]);
  }
  const LevelBlocks blocks(filled, filled_segments, least_segments);
  const std::vector<float> of_filled = ToleranceWalk(blocks, grid, bounds).run();
  std::vector<float> all(leaves.size(), 0);
  for (std::size_t i = 0, f = 0; i < leaves.size(); ++i)
    if (segments[i] != 0) all[i] = of_filled[f++];
  return all;
}

double extentOf_um(const BlockKey& block, const GridBox& content, const Grid& grid) {
  if (content.empty()) return 0;
  const double edge_um = std::ldexp(grid.quantum_um(), kMortonAxisBits - block.depth / kOctree);
  return std::min(edge_um, (content.hi - content.lo).cast<double>().maxCoeff() * grid.quantum_um());
}

}  // namespace filiform::internal
