// SegmentSieve: which segments of a tile a filter takes. Thread rule: immutable once made.
#pragma once

#include "index/query/segment_filter.h"
#include "index/set/tile_store.h"
#include "index/tile/tile_engine.h"

#include <functional>
#include <vector>

namespace filiform::internal {

// The runs of those segments of a tile that `take` has, in the order of the tile's runs.
std::vector<SegmentRun> someRuns(const Tile& tile, const std::vector<bool>& take);

class SegmentSieve {
 public:
  // Throws UsageError for cells that do not ascend or exist.
  SegmentSieve(const TileStore& store, const SegmentFilter& filter);

  bool takesAll() const { return !of_cells_ && !of_types_; }
  bool ofCells() const { return of_cells_; }
  bool ofTypes() const { return of_types_; }
  // False: the tile holds no segment of a wanted type.
  bool mayHold(const TileEntry& entry) const { return (entry.types & mask_) != 0; }
  // True: all segments that the tile stores have wanted types.
  bool allTypesOf(const TileEntry& entry) const { return (entry.types & ~pure_) == 0; }

  struct Sifted {
    std::vector<SegmentRun> sure;    // wanted
    std::vector<SegmentRun> unsure;  // ghosts of wanted cells: the tile that owns them knows their types
    std::vector<bool> wanted;        // by segment: owned and wanted; only if there are types
  };
  // `look`: of the tile; null if types do not matter, or all are wanted. `ghosts`: false leaves all of them out.
  Sifted sift(const Tile& tile, const TileAppearance* look, bool ghosts) const;

 private:
  bool of_cells_, of_types_;
  std::vector<bool> cells_;
  std::vector<bool> types_;
  std::function<bool(std::uint32_t, std::uint16_t)> wants_;
  TypeMask mask_ = kAnyType, pure_ = kAnyType;
};

}  // namespace filiform::internal
