// LeafUnit: the segments of neighbouring leaves that form one block (unitEnd() in index/geometry/partition.h).
#pragma once

#include "index/build/internal/segment_chain.h"
#include "index/geometry/morton.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace filiform::internal {

// Thread rule: thread-compatible.
struct LeafUnit {
  static constexpr std::size_t kRecordsKept = std::size_t{1} << 16;  // vectors of larger units are freed after use
  struct Item {
    std::uint32_t record : 31;  // position in `records`
    std::uint32_t owned : 1;
  };

  std::uint32_t first = 0;                 // of the leaves, in Tiler::leaves(); their number for the long-segment tile
  bool is_long = false;                    // the long-segment tile, alone in its unit
  std::span<const BlockKey> keys;          // of the leaves; depth 0 for the long-segment tile
  std::vector<SegmentRecord> records;      // stored by at least one leaf; ascending by id, each once
  std::vector<Item> items;                 // of all leaves: what each stores, ascending by record
  std::vector<std::uint32_t> items_begin;  // by leaf, and the end

  std::span<const Item> of(std::size_t leaf) const {
    return std::span(items).subspan(items_begin[leaf], items_begin[leaf + 1] - items_begin[leaf]);
  }
  // Replaces `segments` and `look` with the content of a leaf: ascending by id. The attributes are those of
  // the owned segments' children.
  void content(std::size_t leaf, std::vector<StoredSegment>& segments, TileAppearance& look) const {
    segments.clear();
    look.radii_um.clear();
    look.types.clear();
    const std::span<const Item> stored = of(leaf);
    segments.reserve(stored.size());
    look.radii_um.reserve(stored.size());
    look.types.reserve(stored.size());
    for (const Item item : stored) segments.push_back(storedSegment(records[item.record], item.owned != 0, look));
  }
};

}  // namespace filiform::internal
