#include "index/query/internal/owned_segments.h"

namespace filiform::internal {
namespace {

// The tile's first segment whose cell id is at least `cell`.
std::uint32_t firstOf(const Tile& tile, std::uint32_t cell) {
  std::uint32_t low = 0, high = tile.segment_count();
  while (low < high) {
    const std::uint32_t middle = low + (high - low) / 2;
    if (tile.segmentId(middle).cell < cell) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  return low;
}

}  // namespace

void appendOwned(const Tile& tile, const TileAppearance* appearance, std::vector<PassedSegment>& segments) {
  segments.reserve(segments.size() + tile.owned_count());
  forEachOwned(tile, appearance, 0, [&segments](const PassedSegment& s) {
    segments.push_back(s);
    return true;
  });
}

void appendOwned(const Tile& tile, const TileAppearance* appearance, std::uint32_t cell,
                 std::vector<PassedSegment>& segments) {
  forEachOwned(tile, appearance, firstOf(tile, cell), [&segments, cell](const PassedSegment& s) {
    if (s.id.cell != cell) return false;
    segments.push_back(s);
    return true;
  });
}

}  // namespace filiform::internal
