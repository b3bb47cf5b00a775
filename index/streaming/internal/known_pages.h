// A view of a store for a caller that must not wait for the disk. If a page of the directory is not read yet, it throws
// an exception that names the page. The caller then reads the page where it may wait, and tries again. Thread rule:
// thread-compatible; the caller's lock guards it.
#pragma once

#include "index/set/tile_store.h"

#include <optional>
#include <string>
#include <vector>

namespace filiform::internal {

// Not an error: the answer is in a page of the directory that is not read yet.
struct PageAbsent {
  std::uint32_t page;
};

class KnownPages final : public TileStore {
 public:
  // The store must outlive this object. O(pages).
  explicit KnownPages(const TileStore& store)
      : store_(store),
        page_tiles_(store.page_tiles()),
        known_((std::size_t{store.tile_count()} + page_tiles_ - 1) / page_tiles_) {}

  // While true (initially), entry() and home() read pages themselves and wait.
  void mayRead(bool may) { may_read_ = may; }
  // Call it after the page was read: its entries are then available.
  void add(std::uint32_t page) { known_[page] = true; }
  TileId firstTile(std::uint32_t page) const { return page * page_tiles_; }

  // entry() and home() throw PageAbsent and what the store throws.
  const TileEntry& entry(TileId tile) const override {
    const std::uint32_t page = tile / page_tiles_;
    if (!may_read_ && !known_.at(page)) throw PageAbsent{page};
    const TileEntry& entry = store_.entry(tile);
    known_[page] = true;
    return entry;
  }
  TileId home(const GridPoint& p) const override {
    if (!may_read_) {
      const LeafIndex& leaves = store_.leaves();
      const std::size_t page = leaves.pageOf(p);
      if (page != LeafIndex::kNoPage && !leaves.knows(page)) throw PageAbsent{static_cast<std::uint32_t>(page)};
    }
    return store_.home(p);
  }

  Grid grid() const override { return store_.grid(); }
  const LeafIndex& leaves() const override { return store_.leaves(); }
  TileId tile_count() const override { return store_.tile_count(); }
  TileId long_tile() const override { return store_.long_tile(); }
  TileId page_tiles() const override { return store_.page_tiles(); }
  GridBox pageContent(std::uint32_t page) const override { return store_.pageContent(page); }
  std::uint64_t floorBytes() const override { return store_.floorBytes(); }
  std::uint32_t capacity() const override { return store_.capacity(); }
  std::shared_ptr<const Tile> load(TileId tile) const override { return store_.load(tile); }
  TileAppearance loadAppearance(TileId tile) const override { return store_.loadAppearance(tile); }
  std::uint32_t cell_count() const override { return store_.cell_count(); }
  const CellRecord& cell(std::uint32_t id) const override { return store_.cell(id); }
  std::optional<std::uint32_t> findCell(const std::string& name) const override { return store_.findCell(name); }
  CellDetail loadCellDetail(std::uint32_t id) const override { return store_.loadCellDetail(id); }
  const Landmarks& landmarks() const override { return store_.landmarks(); }

 private:
  const TileStore& store_;
  const TileId page_tiles_;
  bool may_read_ = true;
  mutable std::vector<bool> known_;  // by page
};

}  // namespace filiform::internal
