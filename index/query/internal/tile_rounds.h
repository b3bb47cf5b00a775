// TileRounds: a search of a set at an address visits a list of tiles. TileRounds reads the next tiles of the list
// before the search needs them, many at once. A round begins when the next tile is missing, and is twice as long as the
// round before, up to kMost. So a search that ends early has read at most about twice what it needed. In a folder the
// system reads ahead, and TileRounds does nothing. Thread rule: thread-compatible.
#pragma once

#include "index/query/internal/tile_cache.h"

#include <algorithm>
#include <cstddef>
#include <span>

namespace filiform::internal {

class TileRounds {
 public:
  static constexpr std::size_t kMost = TileCache::kLeastAhead;

  // `first`: the length of the first round. The cache must outlive this object.
  TileRounds(const TileStore& store, TileCache& cache, std::size_t first)
      : cache_(store.isRemote() ? &cache : nullptr), length_(std::min(first, kMost)) {}

  // Call it before tile `i` of the list is visited; `tiles` may grow meanwhile.
  void before(std::size_t i, std::span<const TileId> tiles) {
    if (cache_ == nullptr || i < end_ || cache_->peek(tiles[i])) return;
    end_ = std::min(tiles.size(), i + length_);
    cache_->readAhead(tiles.subspan(i, end_ - i));
    length_ = std::min(2 * length_, kMost);
  }
  std::size_t length() const { return length_; }  // of the next round

 private:
  TileCache* const cache_;
  std::size_t length_, end_ = 0;
};

}  // namespace filiform::internal
