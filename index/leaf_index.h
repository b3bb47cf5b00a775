// Which tile is home to a point: the sorted keys of all leaves, in pages that a store may add one by one. Thread rule:
// home() from any thread, the haptic one included, also while a page is added; it sees the page whole or not at all.
#pragma once

#include "index/tile.h"

#include <atomic>
#include <memory>
#include <vector>

namespace filiform {

class LeafIndex {
 public:
  static constexpr std::size_t kNoPage = SIZE_MAX;

  LeafIndex() = default;
  // All leaves. Requires disjoint cells in ascending order of `low`. Tile ids are positions in `leaves`.
  explicit LeafIndex(std::vector<CellKey> leaves);
  // Of `size` leaves of which none is known yet, `page_tiles` in each page but the last: the lowest key of each page,
  // ascending.
  LeafIndex(std::vector<MortonKey> page_lows, TileId page_tiles, TileId size);

  TileId size() const { return size_; }  // known or not
  // The page in whose range of keys the point lies, or kNoPage. O(log pages).
  std::size_t pageOf(const GridPoint& p) const noexcept;
  bool knows(std::size_t page) const noexcept { return pages_[page].known.load(std::memory_order_acquire); }
  // Once for each page, from one thread at a time. Requires its leaves, ascending.
  void add(std::size_t page, std::vector<CellKey> leaves);

  // The tile whose cell contains the point, or kNoTile where space is empty, or where the page is not known. A tile
  // that a store has loaded has the homes of all its nodes in pages that are known: where the point is another,
  // TileStore::home() is the one to ask. O(log tiles).
  TileId home(const GridPoint& p) const noexcept;

 private:
  struct Page {
    std::atomic<bool> known{false};
    std::vector<CellKey> leaves;
  };
  std::vector<MortonKey> lows_;  // of each page
  std::unique_ptr<Page[]> pages_;
  TileId page_tiles_ = 0, size_ = 0;
};

}  // namespace filiform
