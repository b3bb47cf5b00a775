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
        group_pages_(store.group_pages()),
        known_((std::size_t{store.tile_count()} + page_tiles_ - 1) / page_tiles_),
        known_groups_((known_.size() + group_pages_ - 1) / group_pages_) {}

  // While true (initially), entry(), home() and pageContent() read pages themselves and wait.
  void mayRead(bool may) { may_read_ = may; }
  // Call it after the page was read: its entries are then available.
  void add(std::uint32_t page) { known_[page] = known_groups_[page / group_pages_] = true; }
  TileId firstTile(std::uint32_t page) const { return page * page_tiles_; }

  // entry(), home() and pageContent() throw PageAbsent and what the store throws.
  const TileEntry& entry(TileId tile) const override {
    const std::uint32_t page = tile / page_tiles_;
    if (!may_read_ && !known_.at(page)) throw PageAbsent{page};
    const TileEntry& entry = store_.entry(tile);
    known_[page] = known_groups_[page / group_pages_] = true;
    return entry;
  }
  TileId home(const GridPoint& p) const override {
    if (!may_read_) {
      const LeafIndex& leaves = store_.leaves();
      const std::size_t group = leaves.groupOf(p);
      if (group == LeafIndex::kNone) return kNoTile;
      const std::size_t page = leaves.knowsGroup(group) ? leaves.pageOf(p) : leaves.firstPage(group);
      if (page != LeafIndex::kNone && !leaves.knows(page)) throw PageAbsent{static_cast<std::uint32_t>(page)};
    }
    return store_.home(p);
  }

  Grid grid() const override { return store_.grid(); }
  const LeafIndex& leaves() const override { return store_.leaves(); }
  TileId tile_count() const override { return store_.tile_count(); }
  TileId long_tile() const override { return store_.long_tile(); }
  TileId page_tiles() const override { return store_.page_tiles(); }
  std::uint32_t group_pages() const override { return group_pages_; }
  GridBox pageContent(std::uint32_t page) const override {
    const std::uint32_t group = page / group_pages_;
    if (!may_read_ && !known_groups_.at(group)) throw PageAbsent{group * group_pages_};
    const GridBox content = store_.pageContent(page);
    known_groups_[group] = true;
    return content;
  }
  GridBox groupContent(std::uint32_t group) const override { return store_.groupContent(group); }
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
  const std::uint32_t group_pages_;
  bool may_read_ = true;
  mutable std::vector<bool> known_;         // by page
  mutable std::vector<bool> known_groups_;  // by group: its pages' contents
};

}  // namespace filiform::internal
