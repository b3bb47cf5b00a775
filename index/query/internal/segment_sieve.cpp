#include "index/query/internal/segment_sieve.h"

#include "index/errors.h"
#include "index/tile/type_mask.h"

#include <algorithm>
#include <functional>
#include <string>

namespace filiform::internal {

SegmentSieve::SegmentSieve(const TileStore& store, const SegmentFilter& filter)
    : of_cells_(filter.cells.has_value()), of_types_(!filter.types.empty()) {
  if (of_cells_) {
    const std::vector<std::uint32_t>& cells = *filter.cells;
    if (std::adjacent_find(cells.begin(), cells.end(), std::greater_equal<>()) != cells.end())
      throw UsageError("the cells of a filter must ascend");
    if (!cells.empty() && cells.back() >= store.cell_count())
      throw UsageError("the filter names a cell that does not exist: " + std::to_string(cells.back()));
    cells_.resize(store.cell_count());
    for (const std::uint32_t cell : cells) cells_[cell] = true;
  }
  if (!of_types_) return;
  mask_ = pure_ = 0;
  for (const std::uint16_t type : filter.types) {
    types_[type] = true;
    mask_ |= typeMaskOf(type);
  }
  pure_ = mask_ & ~typeMaskOf(UINT16_MAX);  // the bit of many types
}

SegmentSieve::Sifted SegmentSieve::sift(const Tile& tile, const TileAppearance* look, bool ghosts) const {
  Sifted sifted;
  if (of_types_) sifted.wanted.resize(tile.segment_count());
  std::vector<std::uint16_t> types;  // by segment
  if (look != nullptr) {
    types.resize(tile.segment_count());
    for (std::uint32_t s = 0, owned = 0; s < types.size(); ++s)
      if (tile.owned(s)) types[s] = look->types[owned++];
  }
  for (const SegmentRun run : tile.runs()) {
    if (of_cells_ && !cells_[tile.segmentId(run.begin()).cell]) continue;
    std::vector<SegmentRun>* before = nullptr;  // the list of the segment before
    for (std::uint32_t s = run.begin(); s < run.begin() + run.count(); ++s) {
      std::vector<SegmentRun>* list = &sifted.sure;
      const bool owned = tile.owned(s);
      if (!owned && !ghosts)
        list = nullptr;
      else if (look != nullptr)
        list = !owned ? &sifted.unsure : types_[types[s]] ? &sifted.sure : nullptr;
      if (of_types_) sifted.wanted[s] = owned && list != nullptr;
      if (list != nullptr && list == before)
        ++list->back().begin_and_count;  // one segment more
      else if (list != nullptr)
        list->push_back({8 * s});
      before = list;
    }
  }
  return sifted;
}

}  // namespace filiform::internal
