// LeafIndex: finds the home tile of a point. It holds the sorted keys of all leaves, in pages and groups of pages that
// a store may add one by one. Thread rule: any thread may call the const members, the haptic one included, even while a
// page is added. It sees a page completely or not at all.
#pragma once

#include "index/tile/tile.h"

#include <atomic>
#include <memory>
#include <vector>

namespace filiform {

class LeafIndex {
 public:
  static constexpr std::size_t kNone = SIZE_MAX;

  // The size of pages and groups; the last ones may be smaller.
  struct Shape {
    TileId page_leaves = 1;
    std::uint32_t group_pages = 1;
    TileId leaves = 0;  // in all
  };

  LeafIndex() = default;
  // An index with all leaves known. Requires disjoint blocks, ascending by `low`. The tile id is the position in
  // `leaves`.
  explicit LeafIndex(std::vector<BlockKey> leaves);
  // An index in which no group is known yet. Requires the lowest key of each group, ascending.
  LeafIndex(std::vector<MortonKey> group_lows, const Shape& shape);

  TileId size() const { return shape_.leaves; }  // number of leaves, known or not
  // The group whose range of keys contains the point, or kNone. O(log groups).
  std::size_t groupOf(const GridPoint& p) const noexcept { return groupOf(mortonKey(p)); }
  std::size_t groupOf(MortonKey key) const noexcept;
  bool knowsGroup(std::size_t group) const noexcept { return groups_[group].known.load(std::memory_order_acquire); }
  std::size_t firstPage(std::size_t group) const noexcept { return group * shape_.group_pages; }
  // The page whose range of keys contains the point. kNone if there is none, or if its group is not known. O(log
  // pages).
  std::size_t pageOf(const GridPoint& p) const noexcept { return pageOf(mortonKey(p)); }
  std::size_t pageOf(MortonKey key) const noexcept;
  // False if the page's group is not known.
  bool knows(std::size_t page) const noexcept;
  // True if the page of this leaf is known. False for a tile that is not a leaf.
  bool knowsLeaf(TileId leaf) const noexcept { return leaf < shape_.leaves && knows(leaf / shape_.page_leaves); }
  // Adds a group, with the lowest key of each page, ascending. Requires one call a group, and one calling thread at a
  // time for this and add().
  void addGroup(std::size_t group, std::vector<MortonKey> page_lows);
  // Adds the leaves of a page of a known group, ascending. Requires one call a page.
  void add(std::size_t page, std::vector<BlockKey> leaves);

  // The first leaf whose block begins at the key or later. Requires that the page with this key is known, unless a page
  // begins at the key; else returns kNoTile. O(log tiles).
  TileId firstFrom(MortonKey key) const noexcept;

  // The tile whose block contains the point. kNoTile if space is empty there, or if the page is not known. When a store
  // has loaded a tile, the pages of the homes of all its nodes are known. For other points, call TileStore::home().
  // O(log tiles).
  TileId home(const GridPoint& p) const noexcept;

 private:
  struct Page {
    std::atomic<bool> known{false};
    std::vector<BlockKey> leaves;
  };
  struct Group {
    std::atomic<bool> known{false};
    std::vector<MortonKey> lows;  // of each page
    std::unique_ptr<Page[]> pages;
  };
  std::vector<MortonKey> lows_;  // of each group
  std::unique_ptr<Group[]> groups_;
  Shape shape_;
};

}  // namespace filiform
