#include "index/geometry/internal/grown_leaves.h"

#include <algorithm>
#include <cstddef>

namespace filiform::internal {
namespace {

using Keys = std::span<const BlockKey>;

// Those of the blocks that meet `block`.
Keys meeting(Keys keys, const BlockKey& block) {
  const auto begin =
      std::partition_point(keys.begin(), keys.end(), [&](const BlockKey& key) { return key.high() < block.low; });
  const auto end =
      std::partition_point(begin, keys.end(), [&](const BlockKey& key) { return key.low <= block.high(); });
  return keys.subspan(static_cast<std::size_t>(begin - keys.begin()), static_cast<std::size_t>(end - begin));
}

void cover(const BlockKey& block, Keys base, Keys added, std::vector<BlockKey>& leaves) {
  const bool is_base = base.size() == 1 && base[0] == block;
  const bool is_free = base.empty() && (added.empty() || (added.size() == 1 && added[0].depth <= block.depth));
  if (is_base || is_free) {
    leaves.push_back(block);
    return;
  }
  for (const int bit : {0, 1}) {
    const BlockKey half = block.half(bit);
    cover(half, meeting(base, half), meeting(added, half), leaves);
  }
}

}  // namespace

std::vector<BlockKey> grownLeaves(std::span<const BlockKey> base, std::span<const BlockKey> added) {
  std::vector<BlockKey> leaves;
  cover(BlockKey{}, base, added, leaves);
  return leaves;
}

}  // namespace filiform::internal
