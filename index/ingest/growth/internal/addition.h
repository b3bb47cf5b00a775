// Addition: puts the cells of one set into the tiles of another.
#pragma once

#include "index/geometry/partition.h"
#include "index/ingest/growth/internal/grown_revision.h"
#include "index/ingest/growth/internal/removal.h"
#include "index/set/tile_set.h"

#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

namespace filiform::internal {

// Both sets have the same grid. The ids of added cells follow those of the base. The leaves of the base stay; the empty
// space between them is divided as in the added set. Segments that the added set holds in its long-segment tile go to
// that of the base. Thread rule: thread-compatible.
class Addition {
 public:
  // `without`: what remains of the tiles of the base. All arguments must outlive the object.
  Addition(const TileSet& base, const TileSet& added, const TilesWithout& without, GrownRevision& to);

  // Passes all tiles of the new revision on and numbers them. step(done, total) is called for each added tile. Throws
  // what the sets and the revision throw. O(tiles + segments added).
  void run(const std::function<void(std::uint64_t done, std::uint64_t total)>& step);
  // After run(): the tiles that own a segment of an added cell, ascending.
  std::vector<TileId> tilesOf(std::uint32_t added_cell) const;

 private:
  struct Entry {
    std::uint32_t leaf, segment;  // position in leaves(); in segments_
    std::uint32_t look;           // in looks_; kNoLook if its tile does not own the segment
  };
  void place(TileId tile);
  void flush();
  void finishLeaf(std::uint32_t leaf, std::vector<StoredSegment> segments, const TileAppearance& look);
  void addLong();
  GrownRevision::Item addTo(TileId tile, std::vector<StoredSegment> segments, const TileAppearance& look,
                            TypeMask types);
  bool isLong(const SegmentId& id) const;
  void meet(const StoredSegment& s, std::uint32_t begin, std::uint32_t end);

  const TileSet &base_, &added_;
  const TilesWithout& without_;
  GrownRevision& to_;
  Partition partition_;
  std::vector<TileId> base_of_;          // by leaf
  std::vector<bool> done_;               // by tile of the base
  std::vector<SegmentId> long_;          // of the added set, ascending
  std::vector<StoredSegment> segments_;  // gathered
  TileAppearance looks_;                 // of them
  TypeMask types_ = 0;                   // at least theirs
  std::vector<Entry> entries_;
  std::uint32_t open_begin_ = 0, open_end_ = 0;  // the leaves that are being gathered
  std::vector<std::uint32_t> met_;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> owners_;  // added cell, item of the revision
};

}  // namespace filiform::internal
