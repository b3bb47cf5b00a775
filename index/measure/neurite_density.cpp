#include "index/measure/neurite_density.h"

#include "index/cell/soma.h"
#include "index/count_text.h"
#include "index/errors.h"
#include "index/query/segment_pass.h"
#include "index/set/reads_at_once.h"
#include "index/set/tiles_ahead.h"
#include "index/tile/type_mask.h"
#include "index/workers.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>
#include <tuple>
#include <utility>

namespace filiform {
namespace {

// The number of steps below or at a coordinate: planes and boxes agree to the last bit.
double stepsBelow(double at_um, double step_um) {
  double steps = std::floor(at_um / step_um);
  if (steps * step_um > at_um) --steps;
  if ((steps + 1) * step_um <= at_um) ++steps;
  return steps;
}

std::vector<std::uint32_t> chosenCells(const TileStore& store, const DensityOptions& options) {
  if (options.cells) return *options.cells;
  std::vector<std::uint32_t> cells(store.cell_count());
  std::iota(cells.begin(), cells.end(), 0);
  return cells;
}

NeuriteDensity emptyGrid(const TileStore& store, const std::vector<std::uint32_t>& cells,
                         const DensityOptions& options) {
  const double step_um = options.step_um;
  if (!(step_um > 0) || std::isinf(step_um)) throw UsageError("the step of a grid must be a finite number above 0 um");
  GridBox bounds;
  for (const std::uint32_t cell : cells)
    if (const GridBox& box = store.cell(cell).bounds; !box.empty()) bounds.extend(box);
  NeuriteDensity grid{.step_um = step_um, .lengths_um = {}};
  if (bounds.empty()) return grid;
  const Vector3d lo_W = store.grid().toWorld(bounds.lo), hi_W = store.grid().toWorld(bounds.hi);
  std::array<double, 3> boxes{};
  double all = 1;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double first = stepsBelow(lo_W[static_cast<int>(axis)], step_um);
    boxes[axis] = stepsBelow(hi_W[static_cast<int>(axis)], step_um) - first + 1;
    all *= boxes[axis];
    if (std::abs(first) < 0x1p52) grid.first[axis] = static_cast<std::int64_t>(first);
  }
  if (!(all <= static_cast<double>(options.most_boxes)))
    throw UsageError("a grid of " + (all < 1e18 ? formatCount(static_cast<std::uint64_t>(all)) : "more than 1e18") +
                     " boxes about the cells; at most " + formatCount(options.most_boxes) +
                     " are kept: give a larger step or fewer cells");
  for (std::size_t axis = 0; axis < 3; ++axis) grid.boxes[axis] = static_cast<std::size_t>(boxes[axis]);
  grid.lengths_um.resize(static_cast<std::size_t>(all));
  return grid;
}

// The samples of type 1 of all chosen cells.
class Somata {
 public:
  Somata(const TileStore& store, const std::vector<std::uint32_t>& cells, const DensityOptions& options)
      : ranks_(store.cell_count()) {
    std::vector<bool> wanted(store.cell_count());
    for (const std::uint32_t cell : cells) wanted[cell] = true;
    runItems(cells.size(), std::max(options.threads, readsAtOnce(store)), [&](std::size_t i) {
      if (store.cell(cells[i]).removed) return;
      for (const CellDetail::Root& root : store.loadCellDetail(cells[i]).roots)
        if (root.type == kSomaType) ranks_[cells[i]].push_back(root.rank);
    });
    std::vector<TileId> tiles = tilesOf(store, cells);
    std::erase_if(tiles, [&](TileId tile) { return (store.entry(tile).types & typeMaskOf(kSomaType)) == 0; });
    TilesAhead ahead(store, tiles, true, TilesAhead::Reads::background, options.threads);
    for (std::size_t i = 0; i < tiles.size(); ++i) {
      if (options.check) options.check();
      const auto [tile, appearance] = ahead.next();
      for (std::uint32_t s = 0, owned = 0; s < tile->segment_count(); ++s) {
        if (!tile->owned(s) || appearance.types[owned++] != kSomaType) continue;
        const NodeId child = tile->link(s).child_id;
        if (wanted[child.cell]) ranks_[child.cell].push_back(child.sample);
      }
    }
    for (std::vector<std::uint32_t>& ranks : ranks_) std::sort(ranks.begin(), ranks.end());
  }
  bool has(std::uint32_t cell, std::uint32_t rank) const {
    const std::vector<std::uint32_t>& ranks = ranks_[cell];
    return !ranks.empty() && rank <= ranks.back() && std::binary_search(ranks.begin(), ranks.end(), rank);
  }

 private:
  std::vector<std::vector<std::uint32_t>> ranks_;  // by cell, ascending
};

// Calls use(box, length_um) for each box that the segment passes.
template <typename Use>
void cutSegment(const NeuriteDensity& grid, const Vector3d& from_W, const Vector3d& to_W, const Use& use) {
  const Vector3d d_W = to_W - from_W;
  const double length_um = d_W.norm();
  std::array<std::int64_t, 3> at{};  // the box, in steps
  std::array<std::size_t, 3> strides{grid.boxes[1] * grid.boxes[2], grid.boxes[2], 1};
  std::array<double, 3> leaves{};  // the share of the segment at which it leaves the box along an axis
  std::size_t box = 0;
  const auto leave = [&](std::size_t axis) {
    const auto i = static_cast<int>(axis);
    if (d_W[i] == 0) return std::numeric_limits<double>::infinity();
    const double plane_um = static_cast<double>(at[axis] + (d_W[i] > 0 ? 1 : 0)) * grid.step_um;
    return (plane_um - from_W[i]) / d_W[i];
  };
  for (std::size_t axis = 0; axis < 3; ++axis) {
    at[axis] = static_cast<std::int64_t>(stepsBelow(from_W[static_cast<int>(axis)], grid.step_um));
    box += static_cast<std::size_t>(at[axis] - grid.first[axis]) * strides[axis];
    leaves[axis] = leave(axis);
  }
  for (double t = 0;;) {
    const auto axis = static_cast<std::size_t>(std::min_element(leaves.begin(), leaves.end()) - leaves.begin());
    const std::int64_t next = at[axis] + (d_W[static_cast<int>(axis)] > 0 ? 1 : -1), inside = next - grid.first[axis];
    const bool ends =
        leaves[axis] >= 1 || inside < 0 || inside >= static_cast<std::int64_t>(grid.boxes[axis]);  // by rounding
    const double until = ends ? 1 : leaves[axis];
    if (until > t) use(box, (until - t) * length_um), t = until;
    if (ends) return;
    box = next > at[axis] ? box + strides[axis] : box - strides[axis];
    at[axis] = next;
    leaves[axis] = leave(axis);
  }
}

// The lengths of groups, some of a group in parts. Merges them when they have doubled, or when a quarter of the limit
// has come.
class GroupLengths {
 public:
  explicit GroupLengths(std::uint64_t most) : most_(most) {}

  void add(const DensityGroup& part) {
    if (!parts_.empty() && !isLower(parts_.back(), part) && !isLower(part, parts_.back())) {
      parts_.back().length_um += part.length_um;
      return;
    }
    if (parts_.size() >= full_) {
      merge();
      full_ = std::max(std::min(2 * parts_.size(), parts_.size() + most_ / 4), kLeast);
      parts_.reserve(full_);
    }
    parts_.push_back(part);
  }
  std::vector<DensityGroup> take() {
    merge();
    return std::move(parts_);
  }

 private:
  static constexpr std::size_t kLeast = std::size_t{1} << 16;
  static bool isLower(const DensityGroup& a, const DensityGroup& b) {
    return std::tie(a.box, a.cell, a.type) < std::tie(b.box, b.cell, b.type);
  }
  void merge() {
    // In place, where a stable sort takes a buffer; ordered by length too, so the sums do not depend on the sort.
    std::sort(parts_.begin(), parts_.end(), [](const DensityGroup& a, const DensityGroup& b) {
      return std::tie(a.box, a.cell, a.type, a.length_um) < std::tie(b.box, b.cell, b.type, b.length_um);
    });
    std::size_t kept = 0;
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      if (kept > 0 && !isLower(parts_[kept - 1], parts_[i]))
        parts_[kept - 1].length_um += parts_[i].length_um;
      else
        parts_[kept++] = parts_[i];
    }
    parts_.resize(kept);
    if (kept > most_)
      throw UsageError("more than " + formatCount(most_) +
                       " groups of boxes, cells and types: give a larger step or fewer cells");
  }

  const std::size_t most_;
  std::size_t full_ = kLeast;
  std::vector<DensityGroup> parts_;
};

}  // namespace

NeuriteDensity densityOf(const TileStore& store, const DensityOptions& options) {
  const std::vector<std::uint32_t> cells = chosenCells(store, options);
  NeuriteDensity grid = emptyGrid(store, cells, options);
  if (grid.lengths_um.empty()) return grid;
  const Somata somata(store, cells, options);
  const auto isWanted = [&](std::uint16_t type) {
    return options.types.empty() || std::find(options.types.begin(), options.types.end(), type) != options.types.end();
  };
  const Grid positions = store.grid();
  GroupLengths groups(options.most_boxes);
  forEachSegment(store,
                 {.with_appearance = true,
                  .cells = options.cells,
                  .threads = std::max(options.threads, 1U),
                  .check = options.check},
                 [&](TileId, std::span<const PassedSegment> segments) {
                   for (const PassedSegment& s : segments) {
                     if (s.type == kSomaType || !isWanted(s.type) || somata.has(s.id.cell, s.parent_sample)) continue;
                     const std::uint32_t cell = options.by_cell ? s.id.cell : 0;
                     const std::uint16_t type = options.by_type ? s.type : std::uint16_t{0};
                     cutSegment(grid, positions.toWorld(s.child), positions.toWorld(s.parent),
                                [&](std::size_t box, double length_um) {
                                  grid.lengths_um[box] += length_um;
                                  if (options.by_cell || options.by_type) groups.add({box, cell, type, length_um});
                                });
                   }
                 });
  grid.groups = groups.take();
  return grid;
}

}  // namespace filiform
