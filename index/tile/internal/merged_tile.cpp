#include "index/tile/internal/merged_tile.h"

#include "index/file/internal/bytes.h"

namespace filiform::internal {

void appendSegments(const Tile& tile, std::vector<StoredSegment>& segments) {
  segments.reserve(segments.size() + tile.segment_count());
  for (std::uint32_t s = 0; s < tile.segment_count(); ++s) {
    const Tile::Link link = tile.link(s);
    segments.push_back({link.id, link.child_id.sample, link.parent_id.sample, tile.gridPoint(link.child),
                        tile.gridPoint(link.parent), tile.owned(s)});
  }
}

void appendAppearance(const TileAppearance& look, TileAppearance& to) {
  to.radii_um.insert(to.radii_um.end(), look.radii_um.begin(), look.radii_um.end());
  to.types.insert(to.types.end(), look.types.begin(), look.types.end());
}

// Fragments, nodes and lists of different cells are apart, so a merged tile is as large as both together, but for two
// tables: positions (6, 8, 12 or 24 bytes a node, by the bits of the largest), and tables that only tiles with loops
// have (12 bytes and a bit a fragment).
std::uint64_t mergedBytesBound(std::uint64_t bytes, std::uint32_t stored, const Tile& patch, const GridBox& bounds) {
  constexpr std::uint64_t kNodesOfSegment = 2, kLeast = 6, kLoops = 13;
  const int bits = bounds.empty() ? 0 : bitsFor(static_cast<std::uint64_t>((bounds.hi - bounds.lo).maxCoeff()));
  const std::uint64_t of_node = bits <= 16 ? 6 : bits <= 21 ? 8 : bits <= 32 ? 12 : 24;
  const std::uint64_t segments = std::uint64_t{stored} + patch.segment_count();
  return bytes + patch.bytes() + segments * (kNodesOfSegment * (of_node - kLeast) + kLoops);
}

}  // namespace filiform::internal
