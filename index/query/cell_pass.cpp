#include "index/query/cell_pass.h"

#include "index/query/internal/cell_assembly.h"
#include "index/query/internal/owned_segments.h"
#include "index/remote/internal/background_reads.h"
#include "index/set/reads_at_once.h"
#include "index/set/tiles_ahead.h"
#include "index/tile/internal/waiting_segments.h"
#include "index/workers.h"

#include <algorithm>
#include <optional>
#include <utility>

namespace filiform {
namespace {

constexpr std::uint64_t kBytesASample = 48, kBytesACell = 1024;  // of a CellAssembly
constexpr bool kInPage = sizeof(void*) == 4;

}  // namespace

struct CellPass::Impl {
  using Assembly = internal::CellAssembly;

  static constexpr std::uint32_t kNowhere = UINT32_MAX;

  const TileStore& store;
  const std::vector<std::uint32_t> cells;
  const CellPassOptions options;
  std::size_t taken = 0, begin = 0, end = 0;    // cells: given out; put together
  std::vector<std::unique_ptr<Assembly>> open;  // of these; nullptr: given out
  std::vector<std::uint32_t> place;             // by cell: its position in `cells`, or kNowhere
  std::vector<std::size_t> groups;              // their first cells; empty: no segments wait
  std::size_t group = 0;                        // of `begin`
  std::optional<internal::WaitingSegments> waiting;
  std::vector<TileId> tiles;
  std::size_t tiles_taken = 0;
  std::optional<TilesAhead> ahead;
  std::vector<PassedSegment> segments;

  Impl(const TileStore& s, std::vector<std::uint32_t> c, CellPassOptions o)
      : store(s), cells(std::move(c)), options(std::move(o)), place(s.cell_count(), kNowhere) {}

  // The end of the cells from `from` on that fit, at least one.
  std::size_t endOfCells(std::size_t from, std::uint64_t memory_bytes) const {
    std::uint64_t bytes = 0;
    std::size_t to = from;
    for (; to < cells.size(); ++to) {
      const CellRecord& record = store.cell(cells[to]);
      bytes += kBytesACell + kBytesASample * std::max(record.samples, record.segments);
      if (to > from && bytes > memory_bytes) break;
    }
    return to;
  }

  // Parts the cells into groups, if they do not fit. Half of the memory is for cells.
  void makeGroups() {
    if (kInPage || endOfCells(0, options.memory_bytes) == cells.size()) return;
    for (std::size_t from = 0; from < cells.size(); from = endOfCells(from, options.memory_bytes / 2))
      groups.push_back(from);
    if (groups.size() * kGroupBytes > options.memory_bytes)
      groups.clear();
    else
      waiting.emplace(groups.size(), options.memory_bytes / 2);
  }

  std::size_t groupOf(std::uint32_t cell) const {
    return static_cast<std::size_t>(std::upper_bound(groups.begin(), groups.end(), place[cell]) - groups.begin()) - 1;
  }

  void beginPass() {
    const bool is_first = begin == end;
    if (is_first) makeGroups();
    if (!groups.empty() && !is_first) {
      while (tiles_taken < tiles.size()) takeTile();
      ++group;
    }
    begin = end;
    end = groups.empty()              ? endOfCells(begin, options.memory_bytes)
          : group + 1 < groups.size() ? groups[group + 1]
                                      : cells.size();
    ahead.reset();
    open.clear();
    open.resize(end - begin);
    readAtOnce(open.size(), [&](std::size_t i) {
      const std::uint32_t cell = cells[begin + i];
      open[i] = std::make_unique<Assembly>(store, cell, store.loadCellDetail(cell), options.with_appearance);
    });
    if (groups.empty() || is_first)
      beginTiles(groups.empty() ? end : cells.size());
    else
      waiting->take(group, [this](TileId tile, std::span<const PassedSegment> of_cell) { add(tile, of_cell); });
  }

  template <typename Read>
  void readAtOnce(std::size_t count, const Read& read) const {
    runItems(count, readsAtOnce(store), [&](std::size_t i) {
      const internal::BackgroundReads background(true);
      read(i);
    });
  }

  // Begins to read the tiles of the cells from `begin` to `last`.
  void beginTiles(std::size_t last) {
    constexpr std::size_t kLists = 1024;  // in memory at once
    std::fill(place.begin(), place.end(), kNowhere);
    std::vector<bool> needed(store.tile_count());
    for (std::size_t i = begin; i < last; ++i) place[cells[i]] = static_cast<std::uint32_t>(i);
    for (const auto& assembly : open)
      for (const TileId tile : assembly->tiles()) needed[tile] = true;
    std::vector<std::vector<TileId>> lists;
    for (std::size_t i = end; i < last; i += lists.size()) {
      lists.assign(std::min(kLists, last - i), {});
      readAtOnce(lists.size(), [&](std::size_t k) { lists[k] = store.cellTiles(cells[i + k]); });
      for (const auto& list : lists)
        for (const TileId tile : list) needed[tile] = true;
    }
    tiles.clear();
    for (TileId tile = 0; tile < needed.size(); ++tile)
      if (needed[tile]) tiles.push_back(tile);
    tiles_taken = 0;
    ahead.emplace(store, tiles, options.with_appearance, TilesAhead::Reads::background, options.threads);
  }

  void takeTile() {
    if (options.check) options.check();
    const TileId id = tiles[tiles_taken++];
    const auto [tile, appearance] = ahead->next();
    std::uint32_t cell = kNowhere;  // whose segments come
    bool is_wanted = false, is_direct = false;
    Assembly::Filling filling;
    segments.clear();
    const auto endCell = [&] {
      if (segments.empty()) return;
      if (place[cell] < end)
        add(id, segments);
      else
        waiting->add(groupOf(cell), id, segments);
      segments.clear();
    };
    internal::forEachOwned(
        *tile, options.with_appearance ? &appearance : nullptr,
        0, [&](const PassedSegment& s) __attribute__((always_inline)) {
          if (s.id.cell != cell) {
            endCell();
            cell = s.id.cell;
            Assembly* const to = place[cell] < end ? assemblyOf(cell, id) : nullptr;
            is_direct = to != nullptr && to->takesEach();
            is_wanted = to != nullptr || (place[cell] != kNowhere && place[cell] >= end);
            if (is_direct) filling = Assembly::Filling(*to);
          }
          if (is_direct)
            filling.add(s);
          else if (is_wanted)
            segments.push_back(s);
          return true;
        });
    endCell();
  }

  // The assembly of an open cell; nullptr if the cell does not name the tile, since readCell() would not read it.
  Assembly* assemblyOf(std::uint32_t cell, TileId tile) const {
    Assembly* const to = open[place[cell] - begin].get();
    return to != nullptr && std::binary_search(to->tiles().begin(), to->tiles().end(), tile) ? to : nullptr;
  }

  void add(TileId tile, std::span<const PassedSegment> of_cell) {
    if (Assembly* const to = assemblyOf(of_cell.front().id.cell, tile); to != nullptr) to->add(tile, of_cell);
  }

  CellGraph next() {
    if (taken == end) beginPass();
    Assembly& first = *open[taken - begin];
    while (!first.tiles().empty() && tiles_taken < tiles.size() && tiles[tiles_taken] <= first.tiles().back())
      takeTile();
    const std::vector<TileId>& again = first.endTiles();
    if (!again.empty()) {
      TilesAhead later(store, again, options.with_appearance);
      for (const TileId id : again) {
        if (options.check) options.check();
        const auto [tile, appearance] = later.next();
        segments.clear();
        internal::appendOwned(*tile, options.with_appearance ? &appearance : nullptr, cells[taken], segments);
        first.add(id, segments);
      }
    }
    CellGraph graph = first.finish();
    open[taken++ - begin].reset();
    return graph;
  }
};

CellPass::CellPass(const TileStore& store, std::vector<std::uint32_t> cells, CellPassOptions options)
    : impl_(std::make_unique<Impl>(store, std::move(cells), std::move(options))) {}
CellPass::~CellPass() = default;

CellGraph CellPass::next() { return impl_->next(); }

}  // namespace filiform
