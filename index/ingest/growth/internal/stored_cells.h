// StoredCells: the cells of one or two sets, as the tiler takes them to make one set of them.
#pragma once

#include "index/attributes/cell_attributes.h"
#include "index/ingest/tiling/internal/cell_work.h"
#include "index/set/tile_set.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

namespace filiform::internal {

// Thread rule: thread-compatible.
class StoredCells {
 public:
  // The cells of all sets that are not removed, ordered as an ingest of everything orders them: by source, then by
  // digest. Equal ones stay in the order of the sets and their ids. The sets must outlive this object. Throws
  // CorruptSet, IoError.
  explicit StoredCells(std::vector<const TileSet*> sets);
  // The same without some cells of the first set. `change` is called for each cell that is taken, and may give it other
  // names and attributes. `cell`: its id, counted on from the first set to the second.
  using Change = std::function<void(std::uint32_t cell, TakenCell& taken)>;
  StoredCells(std::vector<const TileSet*> sets, const std::vector<bool>& removed, Change change);

  std::uint32_t size() const { return static_cast<std::uint32_t>(order_.size()); }
  TakenCell cell(std::uint32_t id) const;
  // Calls `use` for every segment, once, with the new id of its cell. Reads each tile once. O(segments).
  void forEachSegment(const std::function<void(const SegmentRecord& record)>& use) const;

 private:
  struct Place {
    std::uint32_t set, cell;
  };
  std::vector<const TileSet*> sets_;
  Change change_;
  std::vector<Place> order_;                                 // by new id
  std::vector<std::vector<std::uint32_t>> now_;              // new id, by set and cell
  std::vector<std::vector<SomaRoot>> somata_;                // by set
  std::vector<std::unique_ptr<CellAttributes>> attributes_;  // by set
};

}  // namespace filiform::internal
