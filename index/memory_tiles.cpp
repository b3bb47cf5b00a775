#include "index/memory_tiles.h"

#include "index/errors.h"
#include "index/internal/grid_cells.h"
#include "index/internal/tile_entry.h"
#include "index/samples.h"

#include <map>
#include <mutex>

namespace filiform {
namespace {

class MemoryTiles final : public TileStore {
 public:
  MemoryTiles(CellStream& stream, const PartitionOptions& options)
      : capacity_(options.capacity),
        cells_(stream, Grid(options.quantum_exponent), nullptr),
        placement_(internal::place(cells_, options.capacity, nullptr)),
        owning_(internal::owningTiles(cells_, placement_)),
        leaves_(placement_.leaves) {
    for (TileId t = 0; t < placement_.tile_count(); ++t) {
      tiles_.push_back(internal::buildTile(cells_, placement_, t));
      entries_.push_back(internal::entryOf(*tiles_.back()));
    }
    for (std::uint32_t c = 0; c < cells_.cell_count(); ++c) by_name_.emplace(cells_.records()[c].name, c);
  }

  Grid grid() const override { return cells_.grid(); }
  const LeafIndex& leaves() const override { return leaves_; }
  TileId tile_count() const override { return placement_.tile_count(); }
  TileId long_tile() const override { return placement_.has_long ? tile_count() - 1 : kNoTile; }
  const TileEntry& entry(TileId tile) const override { return entries_.at(tile); }
  std::uint32_t capacity() const override { return capacity_; }
  std::shared_ptr<const Tile> load(TileId tile) const override { return tiles_.at(tile); }
  TileAppearance loadAppearance(TileId tile) const override {
    (void)entries_.at(tile);  // an id out of range throws
    return internal::buildAppearance(cells_, placement_, tile);
  }
  std::uint32_t cell_count() const override { return cells_.cell_count(); }
  const CellRecord& cell(std::uint32_t id) const override { return cells_.records().at(id); }
  std::optional<std::uint32_t> findCell(const std::string& name) const override {
    const auto found = by_name_.find(name);
    return found == by_name_.end() ? std::nullopt : std::optional(found->second);
  }
  CellDetail loadCellDetail(std::uint32_t id) const override {
    (void)cells_.records().at(id);
    CellDetail detail = cells_.detail(id);
    detail.tiles = owning_[id];
    return detail;
  }
  const SamplePoints& samples() const override {
    std::call_once(samples_once_, [this] { samples_ = chooseSamples(*this); });
    return samples_;
  }

 private:
  std::uint32_t capacity_;
  internal::GridCells cells_;
  internal::Placement placement_;
  std::vector<std::vector<TileId>> owning_;
  LeafIndex leaves_;
  std::vector<std::shared_ptr<const Tile>> tiles_;
  std::vector<TileEntry> entries_;
  std::map<std::string, std::uint32_t> by_name_;
  mutable std::once_flag samples_once_;
  mutable SamplePoints samples_;
};

}  // namespace

std::unique_ptr<TileStore> buildTilesInMemory(CellStream& stream, const PartitionOptions& options) {
  if (options.capacity == 0) throw UsageError("the capacity of a tile must be at least 1");
  return std::make_unique<MemoryTiles>(stream, options);
}

}  // namespace filiform
