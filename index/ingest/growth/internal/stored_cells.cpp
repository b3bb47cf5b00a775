#include "index/ingest/growth/internal/stored_cells.h"

#include "index/levels/internal/somata_section.h"
#include "index/set/internal/cells_file.h"
#include "index/tile/internal/merged_tile.h"

#include <algorithm>
#include <utility>

namespace filiform::internal {

StoredCells::StoredCells(std::vector<const TileSet*> sets) : StoredCells(std::move(sets), {}, {}) {}

StoredCells::StoredCells(std::vector<const TileSet*> sets, const std::vector<bool>& removed, Change change)
    : sets_(std::move(sets)), change_(std::move(change)) {
  for (std::uint32_t s = 0; s < sets_.size(); ++s) {
    now_.emplace_back(sets_[s]->cell_count(), UINT32_MAX);
    somata_.push_back(storedSomata(*sets_[s]));
    attributes_.push_back(std::make_unique<CellAttributes>(*sets_[s]));
    for (std::uint32_t c = 0; c < sets_[s]->cell_count(); ++c)
      if (!sets_[s]->cell(c).removed && !(s == 0 && c < removed.size() && removed[c])) order_.push_back({s, c});
  }
  std::stable_sort(order_.begin(), order_.end(), [this](const Place& a, const Place& b) {
    const TileSet &one = *sets_[a.set], &other = *sets_[b.set];
    const int order = one.cell(a.cell).source.compare(other.cell(b.cell).source);
    return order != 0 ? order < 0 : one.cellDigest(a.cell) < other.cellDigest(b.cell);
  });
  for (std::uint32_t id = 0; id < order_.size(); ++id) now_[order_[id].set][order_[id].cell] = id;
}

TakenCell StoredCells::cell(std::uint32_t id) const {
  const TileSet& set = *sets_[order_[id].set];
  const std::uint32_t cell = order_[id].cell;
  const std::vector<SomaRoot>& somata = somata_[order_[id].set];
  const auto begin = std::ranges::lower_bound(somata, cell, {}, &SomaRoot::cell);
  const auto end = std::ranges::upper_bound(somata, cell, {}, &SomaRoot::cell);
  TakenCell taken{set.cell(cell),
                  set.cellDigest(cell),
                  withTiles(set.encodedDetail(cell), [](std::vector<TileId>& tiles) { tiles.clear(); }),
                  {begin, end},
                  attributes_[order_[id].set]->of(cell)};
  if (change_) change_(cell + (order_[id].set == 0 ? 0 : sets_[0]->cell_count()), taken);
  return taken;
}

void StoredCells::forEachSegment(const std::function<void(const SegmentRecord& record)>& use) const {
  for (std::size_t s = 0; s < sets_.size(); ++s) {
    std::vector<StoredSegment> segments;
    for (TileId t = 0; t < sets_[s]->tile_count(); ++t) {
      segments.clear();
      appendSegments(*sets_[s]->load(t), segments);
      const TileAppearance look = sets_[s]->loadAppearance(t);
      std::size_t owned = 0;
      for (const StoredSegment& one : segments) {
        if (!one.owned || now_[s][one.id.cell] == UINT32_MAX) {
          owned += one.owned ? 1 : 0;
          continue;
        }
        use({{now_[s][one.id.cell], one.id.segment},
             one.child_sample,
             one.parent_sample,
             one.child,
             one.parent,
             look.radii_um[owned],
             look.types[owned]});
        ++owned;
      }
    }
  }
}

}  // namespace filiform::internal
