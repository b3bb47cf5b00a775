// ForwardingStore: a tile store that answers as another store does. Derived classes replace some answers. Thread rule:
// as the other store.
#pragma once

#include "index/set/tile_store.h"

#include <memory>
#include <optional>
#include <string>

namespace filiform {

class ForwardingStore : public TileStore {
 public:
  // The store must outlive this object.
  explicit ForwardingStore(const TileStore& store) : store_(store) {}

  Grid grid() const override { return store_.grid(); }
  const LeafIndex& leaves() const override { return store_.leaves(); }
  TileId home(const GridPoint& p) const override { return store_.home(p); }
  TileId tile_count() const override { return store_.tile_count(); }
  TileId long_tile() const override { return store_.long_tile(); }
  const TileEntry& entry(TileId tile) const override { return store_.entry(tile); }
  TileId page_tiles() const override { return store_.page_tiles(); }
  std::uint32_t group_pages() const override { return store_.group_pages(); }
  GridBox pageContent(std::uint32_t page) const override { return store_.pageContent(page); }
  GridBox groupContent(std::uint32_t group) const override { return store_.groupContent(group); }
  std::vector<GridBox> pageBoxes(std::uint32_t page) const override { return store_.pageBoxes(page); }
  std::vector<GridBox> groupBoxes(std::uint32_t group) const override { return store_.groupBoxes(group); }
  std::uint64_t floorBytes() const override { return store_.floorBytes(); }
  std::uint64_t segmentCount() const override { return store_.segmentCount(); }
  std::uint64_t decodedBytes() const override { return store_.decodedBytes(); }
  UsualBox usualBox() const override { return store_.usualBox(); }
  std::uint32_t capacity() const override { return store_.capacity(); }
  bool isRemote() const override { return store_.isRemote(); }
  std::shared_ptr<const Tile> load(TileId tile) const override { return store_.load(tile); }
  TileAppearance loadAppearance(TileId tile) const override { return store_.loadAppearance(tile); }
  std::uint32_t cell_count() const override { return store_.cell_count(); }
  const CellRecord& cell(std::uint32_t id) const override { return store_.cell(id); }
  std::optional<std::uint32_t> findCell(const std::string& name) const override { return store_.findCell(name); }
  CellDetail loadCellDetail(std::uint32_t id) const override { return store_.loadCellDetail(id); }
  std::vector<TileId> cellTiles(std::uint32_t id) const override { return store_.cellTiles(id); }
  const Landmarks& landmarks() const override { return store_.landmarks(); }

 protected:
  const TileStore& store_;
};

}  // namespace filiform
