#include "index/tile/internal/narrow_nodes.h"
#include "index/tile/tile.h"

#include <algorithm>

namespace filiform {
namespace {

// Copies `count` bits; those of `to` are zero.
void copyBits(const std::vector<std::uint32_t>& from, std::size_t at, std::vector<std::uint32_t>& to, std::size_t place,
              std::size_t count) {
  while (count > 0) {
    const std::size_t n = std::min(count, 32 - place % 32);
    std::uint64_t bits = from[at / 32];
    if (at % 32 + n > 32) bits |= std::uint64_t{from[at / 32 + 1]} << 32;
    to[place / 32] |= static_cast<std::uint32_t>(bits >> at % 32 & ((std::uint64_t{1} << n) - 1)) << place % 32;
    at += n, place += n, count -= n;
  }
}

}  // namespace

bool Tile::midpointInside(std::uint32_t a, std::uint32_t b) const {
  return withOffsets([&](const auto& offsets) {
    const Offset p = offsets.get(a), q = offsets.get(b);
    return (p[0] + q[0]) / 2 - home_lo_[0] <= home_range_[0] && (p[1] + q[1]) / 2 - home_lo_[1] <= home_range_[1] &&
           (p[2] + q[2]) / 2 - home_lo_[2] <= home_range_[2];
  });
}

std::vector<std::uint32_t> Tile::midpointsInside() const {
  std::vector<std::uint32_t> inside((segment_count_ + 31) / 32, 0);
  const auto set = [&](std::uint32_t s, bool bit) { inside[s / 32] |= std::uint32_t{bit} << s % 32; };
  const internal::NarrowBlock block(key_.box(), origin_);
  if (is_long_ || offset_bits_ > 16 || block.empty) {
    for (std::uint32_t s = 0, f = 0; f < fragments_.size(); ++f)
      for (const std::uint32_t begin = s, end = fragmentEnd(f); s < end; ++s) {
        const std::uint32_t node = fragments_[f].child_node + (s - begin);
        set(s, is_long_ || midpointInside(s == begin ? fragments_[f].parent_node : node - 1, node));
      }
    return inside;
  }
  std::vector<std::uint32_t> after;  // by node: the midpoint to the next node is inside
  internal::findMidpoints(narrow_.data(), node_count_, block, after);
  for (std::uint32_t f = 0; f < fragments_.size(); ++f) {
    const Fragment& fragment = fragments_[f];
    std::uint32_t s = fragment.begin, from = fragment.child_node;
    if (fragment.parent_node + 1 == from) {
      --from;
    } else {
      set(s++, midpointInside(fragment.parent_node, from));
    }
    copyBits(after, from, inside, s, fragmentEnd(f) - s);
  }
  return inside;
}

}  // namespace filiform
