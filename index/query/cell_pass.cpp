#include "index/query/cell_pass.h"

#include "index/query/internal/cell_assembly.h"
#include "index/query/internal/owned_segments.h"
#include "index/remote/internal/background_reads.h"
#include "index/set/reads_at_once.h"
#include "index/set/tiles_ahead.h"
#include "index/workers.h"

#include <algorithm>
#include <optional>
#include <utility>

namespace filiform {
namespace {

constexpr std::uint64_t kBytesASample = 48, kBytesACell = 1024;  // of a CellAssembly

}  // namespace

struct CellPass::Impl {
  using Assembly = internal::CellAssembly;

  static constexpr std::uint32_t kNowhere = UINT32_MAX;

  const TileStore& store;
  const std::vector<std::uint32_t> cells;
  const CellPassOptions options;
  std::size_t taken = 0, begin = 0, end = 0;    // cells: given out; of this pass
  std::vector<std::unique_ptr<Assembly>> open;  // of this pass; nullptr: given out
  std::vector<std::uint32_t> place;             // by cell: in `open`, or kNowhere
  std::vector<TileId> tiles;
  std::size_t tiles_taken = 0;
  std::optional<TilesAhead> ahead;
  std::vector<PassedSegment> segments;

  Impl(const TileStore& s, std::vector<std::uint32_t> c, CellPassOptions o)
      : store(s), cells(std::move(c)), options(std::move(o)), place(s.cell_count(), kNowhere) {}

  void beginPass() {
    ahead.reset();
    for (; begin < end; ++begin) place[cells[begin]] = kNowhere;
    std::uint64_t bytes = 0;
    for (; end < cells.size(); ++end) {
      const CellRecord& record = store.cell(cells[end]);
      bytes += kBytesACell + kBytesASample * std::max(record.samples, record.segments);
      if (end > begin && bytes > options.memory_bytes) break;
    }
    open.clear();
    open.resize(end - begin);
    runItems(open.size(), readsAtOnce(store), [&](std::size_t i) {
      const internal::BackgroundReads background(true);
      const std::uint32_t cell = cells[begin + i];
      open[i] = std::make_unique<Assembly>(store, cell, store.loadCellDetail(cell), options.with_appearance);
    });
    std::vector<bool> needed(store.tile_count());
    for (std::size_t i = 0; i < open.size(); ++i) {
      place[cells[begin + i]] = static_cast<std::uint32_t>(i);
      for (const TileId tile : open[i]->tiles()) needed[tile] = true;
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
    segments.clear();
    internal::appendOwned(*tile, options.with_appearance ? &appearance : nullptr, segments);
    for (auto first = segments.cbegin(); first != segments.cend();) {
      const std::uint32_t cell = first->id.cell;
      auto last = first + 1;
      while (last != segments.cend() && last->id.cell == cell) ++last;
      // As readCell(), which visits only the tiles that the cell names.
      if (place[cell] != kNowhere)
        if (Assembly* const to = open[place[cell]].get();
            to != nullptr && std::binary_search(to->tiles().begin(), to->tiles().end(), id))
          to->add(id, std::span(segments).subspan(static_cast<std::size_t>(first - segments.begin()),
                                                  static_cast<std::size_t>(last - first)));
      first = last;
    }
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
