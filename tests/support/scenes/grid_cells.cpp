#include "tests/support/scenes/grid_cells.h"

#include "index/errors.h"
#include "index/geometry/partition.h"

#include <algorithm>

namespace filiform::internal {
namespace {

void stopIf(const std::atomic<bool>* cancel) {
  if (cancel != nullptr && cancel->load(std::memory_order_relaxed)) throw Interrupted("interrupted");
}

template <typename T>
void appendAll(std::vector<T>& all, const std::vector<T>& some) {
  all.insert(all.end(), some.begin(), some.end());
}

}  // namespace

GridCells::GridCells(CellStream& stream, const Grid& grid, const std::atomic<bool>* cancel) : grid_(grid) {
  for (Cell cell; stream.next(cell);) {
    stopIf(cancel);
    take(cell);
  }
  std::vector<std::string> sources;
  sources.reserve(records_.size());
  for (const CellRecord& record : records_) sources.push_back(record.source);
  std::vector<std::string> names = cellNames(sources, given_names_);
  given_names_ = {};
  for (std::size_t i = 0; i < records_.size(); ++i) records_[i].name = std::move(names[i]);
}

void GridCells::take(Cell& cell) {
  const std::size_t n = cell.samples();
  if (cell.positions_um.size() != n || cell.parents.size() != n || cell.radii_um.size() != n || cell.types.size() != n)
    throw UsageError("a cell was handed over with arrays of different lengths");
  // One of the 32 bits marks owners.
  if (n >= (std::size_t{1} << 31) - sample_count() || records_.size() == UINT32_MAX - 1)
    throw InputError("more than 2^31 samples in one tile set: split the input into several sets");

  const std::size_t base = positions_.size();
  CellRecord record;
  record.source = std::move(cell.source);
  given_names_.push_back(std::move(cell.name));
  record.samples = n;
  for (const Vector3d& p_W : cell.positions_um) {
    positions_.push_back(grid_.snap(p_W));
    record.bounds.extend(positions_.back());
  }
  appendAll(parents_, cell.parents);
  kinds_.resize(base + n, SampleKind::isolated);
  for (std::size_t i = 0; i < n; ++i) {
    const std::uint32_t parent = cell.parents[i];
    if (parent == kNoParent) {
      ++record.roots;
      continue;
    }
    if (parent >= n || parent == i) throw UsageError("a cell was handed over with a parent that does not exist");
    kinds_[base + i] = SampleKind::link;
    ++record.segments;
    if (cell.parents[parent] == kNoParent) kinds_[base + parent] = SampleKind::root;
  }
  record.isolated = static_cast<std::uint64_t>(
      std::count(kinds_.begin() + static_cast<std::ptrdiff_t>(base), kinds_.end(), SampleKind::isolated));
  appendAll(radii_um_, cell.radii_um);
  appendAll(types_, cell.types);
  appendAll(sample_ids_, cell.sample_ids);
  block_starts_.push_back(std::move(cell.block_starts));
  digests_.push_back(cell.digest);
  records_.push_back(std::move(record));
  begin_.push_back(static_cast<std::uint32_t>(base + n));
}

std::uint32_t GridCells::cellOf(std::uint32_t sample) const {
  return static_cast<std::uint32_t>(std::upper_bound(begin_.begin(), begin_.end(), sample) - begin_.begin() - 1);
}

StoredSegment GridCells::segment(std::uint32_t sample, std::uint32_t cell, bool owned) const {
  const std::uint32_t parent = other(sample, cell), rank = sample - begin_[cell];
  return {{cell, rank}, rank, parent - begin_[cell], positions_[sample], positions_[parent], owned};
}

CellDetail GridCells::detail(std::uint32_t cell) const {
  CellDetail detail;
  const std::uint32_t from = begin_[cell], to = begin_[cell + 1];
  detail.sample_ids = IdRuns(std::span(sample_ids_).subspan(from, to - from));
  for (std::uint32_t s = from; s < to; ++s)
    if (parents_[s] == kNoParent) detail.roots.push_back({s - from, radii_um_[s], types_[s]});
  detail.block_starts = block_starts_[cell];
  return detail;
}

Placement place(const GridCells& cells, std::uint32_t capacity, const std::atomic<bool>* cancel) {
  std::vector<MortonKey> midpoints;
  midpoints.reserve(cells.sample_count());
  for (std::uint32_t cell = 0; cell < cells.cell_count(); ++cell)
    for (std::uint32_t s = cells.begin(cell); s < cells.begin(cell + 1); ++s)
      if (cells.isSegment(s))
        midpoints.push_back(mortonKey(midpoint(cells.position(s), cells.position(cells.other(s, cell)))));
  stopIf(cancel);
  std::sort(midpoints.begin(), midpoints.end());
  stopIf(cancel);
  const Partition partition = Partition::split(midpoints, capacity);
  midpoints = {};

  const auto leaf_count = static_cast<std::uint32_t>(partition.leaves().size());
  std::vector<Placement::Stored> found;
  found.reserve(cells.sample_count() + cells.sample_count() / 4);
  std::vector<std::uint64_t> counts(leaf_count + 1, 0);  // the last one is the long-segment tile
  const auto store = [&](std::uint32_t sample, std::uint32_t leaf, bool owned) {
    found.push_back({sample, leaf | (owned ? Placement::Stored::kOwned : 0)});
    ++counts[leaf];
  };
  std::vector<std::uint32_t> met;
  for (std::uint32_t cell = 0; cell < cells.cell_count(); ++cell) {
    stopIf(cancel);
    for (std::uint32_t s = cells.begin(cell); s < cells.begin(cell + 1); ++s) {
      if (!cells.isSegment(s)) continue;
      const GridPoint &a = cells.position(s), &b = cells.position(cells.other(s, cell));
      if (partition.leavesMet(a, b, met)) {
        const std::uint32_t owner = met.size() == 1 ? met[0] : partition.home(midpoint(a, b));
        for (std::uint32_t leaf : met) store(s, leaf, leaf == owner);
      } else {
        const std::uint32_t home_a = partition.home(a), home_b = partition.home(b);
        store(s, home_a, false);
        if (home_b != home_a) store(s, home_b, false);
        store(s, leaf_count, true);
      }
    }
  }

  Placement placement;
  placement.has_long = counts.back() > 0;
  placement.begin.push_back(0);
  std::vector<std::uint32_t> tile_of(leaf_count + 1, kNoTile);
  for (std::uint32_t leaf = 0; leaf <= leaf_count; ++leaf) {
    if (counts[leaf] == 0) continue;
    tile_of[leaf] = placement.tile_count();
    if (leaf < leaf_count) placement.leaves.push_back(partition.leaves()[leaf]);
    placement.begin.push_back(placement.begin.back() + counts[leaf]);
  }
  std::vector<std::uint64_t> next(placement.begin.begin(), placement.begin.end() - 1);
  placement.stored.resize(found.size());
  for (const Placement::Stored& entry : found) {
    const std::uint32_t owned = entry.tile & Placement::Stored::kOwned;
    const std::uint32_t tile = tile_of[entry.tile & ~Placement::Stored::kOwned];
    placement.stored[next[tile]++] = {entry.sample, tile | owned};
  }
  return placement;
}

std::shared_ptr<const Tile> buildTile(const GridCells& cells, const Placement& placement, TileId tile) {
  std::vector<StoredSegment> segments;
  segments.reserve(placement.begin[tile + 1] - placement.begin[tile]);
  std::uint32_t cell = 0;
  for (std::uint64_t i = placement.begin[tile]; i < placement.begin[tile + 1]; ++i) {
    const Placement::Stored& entry = placement.stored[i];
    if (segments.empty() || entry.sample >= cells.begin(cell + 1)) cell = cells.cellOf(entry.sample);
    segments.push_back(cells.segment(entry.sample, cell, entry.owned()));
  }
  return std::make_shared<const Tile>(tile, placement.key(tile), placement.isLong(tile), cells.grid(),
                                      std::move(segments));
}

TileAppearance buildAppearance(const GridCells& cells, const Placement& placement, TileId tile) {
  TileAppearance appearance;
  for (std::uint64_t i = placement.begin[tile]; i < placement.begin[tile + 1]; ++i) {
    if (!placement.stored[i].owned()) continue;
    appearance.radii_um.push_back(cells.radius_um(placement.stored[i].sample));
    appearance.types.push_back(cells.type(placement.stored[i].sample));
  }
  return appearance;
}

std::vector<std::vector<TileId>> owningTiles(const GridCells& cells, const Placement& placement) {
  std::vector<std::vector<TileId>> tiles(cells.cell_count());
  for (TileId tile = 0; tile < placement.tile_count(); ++tile) {
    std::uint32_t cell = 0, end = 0;
    for (std::uint64_t i = placement.begin[tile]; i < placement.begin[tile + 1]; ++i) {
      const Placement::Stored& entry = placement.stored[i];
      if (!entry.owned()) continue;
      if (entry.sample >= end) {
        cell = cells.cellOf(entry.sample);
        end = cells.begin(cell + 1);
        tiles[cell].push_back(tile);
      }
    }
  }
  return tiles;
}

}  // namespace filiform::internal
