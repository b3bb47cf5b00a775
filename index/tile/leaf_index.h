// LeafIndex: finds the home tile of a point. It holds the sorted keys of all leaves, in pages that a store may add one
// by one. Thread rule: any thread may call home(), the haptic one included, even while a page is added. It sees a page
// completely or not at all.
#pragma once

#include "index/tile/tile.h"

#include <atomic>
#include <memory>
#include <vector>

namespace filiform {

class LeafIndex {
 public:
  static constexpr std::size_t kNoPage = SIZE_MAX;

  LeafIndex() = default;
  // An index with all leaves known. Requires disjoint blocks, ascending by `low`. The tile id is the position in
  // `leaves`.
  explicit LeafIndex(std::vector<BlockKey> leaves);
  // An index of `size` leaves, none known yet. Each page has `page_tiles` leaves; the last may have fewer. Requires the
  // lowest key of each page, ascending.
  LeafIndex(std::vector<MortonKey> page_lows, TileId page_tiles, TileId size);

  TileId size() const { return size_; }  // number of leaves, known or not
  // The page whose range of keys contains the point, or kNoPage. O(log pages).
  std::size_t pageOf(const GridPoint& p) const noexcept;
  bool knows(std::size_t page) const noexcept { return pages_[page].known.load(std::memory_order_acquire); }
  // Adds the leaves of a page, ascending. Requires one call a page, and one calling thread at a time.
  void add(std::size_t page, std::vector<BlockKey> leaves);

  // The tile whose block contains the point. kNoTile if space is empty there, or if the page is not known. When a store
  // has loaded a tile, the pages of the homes of all its nodes are known. For other points, call TileStore::home().
  // O(log tiles).
  TileId home(const GridPoint& p) const noexcept;

 private:
  struct Page {
    std::atomic<bool> known{false};
    std::vector<BlockKey> leaves;
  };
  std::vector<MortonKey> lows_;  // of each page
  std::unique_ptr<Page[]> pages_;
  TileId page_tiles_ = 0, size_ = 0;
};

}  // namespace filiform
