#include "index/ingest/memory_tiles.h"

#include "index/errors.h"
#include "index/ingest/internal/tiler.h"
#include "index/set/internal/cells_file.h"
#include "index/set/internal/tile_entry.h"

#include <map>

namespace filiform {
namespace {

class MemoryTiles final : public TileStore, private internal::TileSink {
 public:
  MemoryTiles(CellStream& stream, const PartitionOptions& options)
      : capacity_(options.capacity), grid_(options.quantum_exponent) {
    internal::Tiler tiler({.grid = grid_, .capacity = capacity_});
    tiler.read(stream);
    tiler.cut();
    tiler.tiles(*this);
    landmarks_ = tiler.landmarks();
    const auto leaf_count = static_cast<std::uint32_t>(tiler.leaves().size());
    std::vector<TileId> tile_of(leaf_count + 1, kNoTile);
    std::vector<BlockKey> keys;
    for (internal::LeafContent& found : found_) {
      const auto id = tile_of[found.leaf] = static_cast<TileId>(tiles_.size());
      tiles_.push_back(std::make_shared<const Tile>(id, found.key, found.is_long, grid_, found.segments));
      entries_.push_back(internal::entryOf(*tiles_.back()));
      entries_.back().types = found.types;
      appearances_.push_back(std::move(found.appearance));
      if (found.is_long) {
        long_tile_ = id;
      } else {
        keys.push_back(found.key);
      }
    }
    found_.clear();
    leaves_ = LeafIndex(std::move(keys));
    records_ = tiler.records();
    details_.reserve(records_.size());
    tiler.details(tile_of, [&](internal::ByteSpan detail) {
      details_.push_back(internal::decodeDetail(detail, records_[details_.size()].samples));
    });
    for (std::uint32_t c = 0; c < records_.size(); ++c) by_name_.emplace(records_[c].name, c);
  }

  Grid grid() const override { return grid_; }
  const LeafIndex& leaves() const override { return leaves_; }
  TileId home(const GridPoint& p) const override { return leaves_.home(p); }
  TileId tile_count() const override { return static_cast<TileId>(tiles_.size()); }
  TileId long_tile() const override { return long_tile_; }
  const TileEntry& entry(TileId tile) const override { return entries_.at(tile); }
  std::uint32_t capacity() const override { return capacity_; }
  std::shared_ptr<const Tile> load(TileId tile) const override { return tiles_.at(tile); }
  TileAppearance loadAppearance(TileId tile) const override { return appearances_.at(tile); }
  std::uint32_t cell_count() const override { return static_cast<std::uint32_t>(records_.size()); }
  const CellRecord& cell(std::uint32_t id) const override { return records_.at(id); }
  std::optional<std::uint32_t> findCell(const std::string& name) const override {
    const auto found = by_name_.find(name);
    return found == by_name_.end() ? std::nullopt : std::optional(found->second);
  }
  CellDetail loadCellDetail(std::uint32_t id) const override { return details_.at(id); }
  const Landmarks& landmarks() const override { return landmarks_; }

 private:
  // Leaves come in the order of their keys, since there is one thread.
  void add(unsigned, internal::LeafContent& content) override { found_.push_back(std::move(content)); }

  std::uint32_t capacity_;
  Grid grid_;
  TileId long_tile_ = kNoTile;
  LeafIndex leaves_;
  std::vector<std::shared_ptr<const Tile>> tiles_;
  std::vector<TileEntry> entries_;
  std::vector<TileAppearance> appearances_;
  std::vector<CellRecord> records_;
  std::vector<CellDetail> details_;
  std::map<std::string, std::uint32_t> by_name_;
  Landmarks landmarks_;
  std::vector<internal::LeafContent> found_;  // used while tiles are cut
};

}  // namespace

std::unique_ptr<TileStore> buildTilesInMemory(CellStream& stream, const PartitionOptions& options) {
  if (options.capacity == 0) throw UsageError("the capacity of a tile must be at least 1");
  return std::make_unique<MemoryTiles>(stream, options);
}

}  // namespace filiform
