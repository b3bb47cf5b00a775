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

class Appender {
 public:
  Appender(const Tile& tile, const TileAppearance* appearance, std::uint32_t first,
           std::vector<PassedSegment>& segments)
      : tile_(tile),
        appearance_(appearance),
        segments_(segments),
        owned_(first < tile.segment_count() ? tile.ownedIndex(first) : 0) {}

  void add(std::uint32_t segment, const Tile::Link& link) {
    if (!tile_.owned(segment)) return;
    PassedSegment& s = segments_.emplace_back();
    s.id = link.id;
    s.child_sample = link.child_id.sample;
    s.parent_sample = link.parent_id.sample;
    s.child = tile_.gridPoint(link.child);
    // Mostly the child of the segment before: its position is known.
    s.parent = link.parent == last_child_ ? last_ : tile_.gridPoint(link.parent);
    last_child_ = link.child;
    last_ = s.child;
    if (appearance_ != nullptr) {
      s.radius_um = appearance_->radii_um[owned_];
      s.type = appearance_->types[owned_];
    }
    ++owned_;
  }

 private:
  const Tile& tile_;
  const TileAppearance* const appearance_;
  std::vector<PassedSegment>& segments_;
  std::uint32_t owned_;
  std::uint32_t last_child_ = UINT32_MAX;
  GridPoint last_ = GridPoint::Zero();
};

}  // namespace

void appendOwned(const Tile& tile, const TileAppearance* appearance, std::vector<PassedSegment>& segments) {
  segments.reserve(segments.size() + tile.owned_count());
  Appender appender(tile, appearance, 0, segments);
  for (std::uint32_t s = 0; s < tile.segment_count(); ++s) appender.add(s, tile.link(s));
}

void appendOwned(const Tile& tile, const TileAppearance* appearance, std::uint32_t cell,
                 std::vector<PassedSegment>& segments) {
  const std::uint32_t first = firstOf(tile, cell);
  Appender appender(tile, appearance, first, segments);
  for (std::uint32_t s = first; s < tile.segment_count(); ++s) {
    const Tile::Link link = tile.link(s);
    if (link.id.cell != cell) break;
    appender.add(s, link);
  }
}

}  // namespace filiform::internal
