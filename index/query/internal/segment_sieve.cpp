#include "index/query/internal/segment_sieve.h"

#include "index/errors.h"
#include "index/tile/type_mask.h"

#include <algorithm>
#include <functional>
#include <string>

namespace filiform::internal {

SegmentSieve::SegmentSieve(const TileStore& store, const SegmentFilter& filter)
    : of_cells_(filter.cells.has_value()),
      of_types_(!filter.types.empty() || filter.wants),
      types_(65536, filter.types.empty()),
      wants_(filter.wants) {
  if (of_cells_) {
    const std::vector<std::uint32_t>& cells = *filter.cells;
    if (std::adjacent_find(cells.begin(), cells.end(), std::greater_equal<>()) != cells.end())
      throw UsageError("the cells of a filter must ascend");
    if (!cells.empty() && cells.back() >= store.cell_count())
      throw UsageError("the filter names a cell that does not exist: " + std::to_string(cells.back()));
    cells_.resize(store.cell_count());
    for (const std::uint32_t cell : cells) cells_[cell] = true;
  }
  if (wants_) pure_ = 0;
  if (filter.types.empty()) return;
  mask_ = pure_ = 0;
  for (const std::uint16_t type : filter.types) {
    types_[type] = true;
    mask_ |= typeMaskOf(type);
  }
  if (!wants_) pure_ = mask_ & ~typeMaskOf(UINT16_MAX);  // the bit of many types
}

std::vector<SegmentRun> someRuns(const Tile& tile, const std::vector<bool>& take) {
  std::vector<SegmentRun> runs;
  for (const SegmentRun run : tile.runs()) {
    bool continues = false;
    for (std::uint32_t s = run.begin(); s < run.begin() + run.count(); ++s) {
      if (take[s] && continues)
        ++runs.back().begin_and_count;  // one segment more
      else if (take[s])
        runs.push_back({8 * s});
      continues = take[s];
    }
  }
  return runs;
}

SegmentSieve::Sifted SegmentSieve::sift(const Tile& tile, const TileAppearance* look, bool ghosts) const {
  std::vector<bool> sure(tile.segment_count()), unsure(tile.segment_count()),
      wanted(of_types_ ? tile.segment_count() : 0);
  std::uint32_t at = 0;  // among the owned
  for (std::uint32_t s = 0; s < tile.segment_count(); ++s) {
    const bool owned = tile.owned(s);
    const std::uint16_t type = look != nullptr && owned ? look->types[at] : 0;
    at += owned ? 1 : 0;
    const std::uint32_t cell = tile.segmentId(s).cell;
    if ((of_cells_ && !cells_[cell]) || (!owned && !ghosts)) continue;
    const bool has_type = look == nullptr || (owned && types_[type] && (!wants_ || wants_(cell, type)));
    sure[s] = has_type;
    unsure[s] = !owned && look != nullptr;
    if (of_types_) wanted[s] = owned && has_type;
  }
  return {someRuns(tile, sure), someRuns(tile, unsure), std::move(wanted)};
}

}  // namespace filiform::internal
