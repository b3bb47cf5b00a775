// LeafContent: what one leaf stores.
#pragma once

#include "index/geometry/morton.h"
#include "index/tile/internal/segment_chain.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace filiform::internal {

// Thread rule: thread-compatible.
struct LeafContent {
  std::uint32_t leaf = 0;               // its position in Tiler::leaves(); their number for the long-segment tile
  bool is_long = false;                 // the long-segment tile
  BlockKey key;                         // depth 0 for the long-segment tile
  std::vector<StoredSegment> segments;  // ascending by id
  TileAppearance appearance;            // of the owned segments' children
  TypeMask types = 0;                   // of all segments

  // Replaces the segments by `count` others: record(i) returns a SegmentRecord, owned(i) whether the leaf owns it.
  template <typename Record, typename Owned>
  void fill(std::size_t count, const Record& record, const Owned& owned) {
    segments.clear();
    segments.reserve(count);
    appearance.radii_um.clear();
    appearance.types.clear();
    appearance.radii_um.reserve(count);
    appearance.types.reserve(count);
    types = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const SegmentRecord& r = record(i);
      segments.push_back({r.id, r.child_sample, r.parent_sample, r.child, r.parent, owned(i)});
      types |= typeMaskOf(r.type);
      if (!owned(i)) continue;
      appearance.radii_um.push_back(r.radius_um);
      appearance.types.push_back(r.type);
    }
  }
};

}  // namespace filiform::internal
