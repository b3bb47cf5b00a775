// The tiles that one reader may use right now. Each reader (haptic loop, viewer, jump resolver) owns its table and
// changes it only between its own ticks, when it takes messages from the loader: so no lock, allocation or reference
// count while it works. Thread rule: owned by one thread.
#pragma once

#include "index/tile.h"

#include <vector>

namespace filiform {

class TileTable {
 public:
  // Room for tile ids 0 .. tile_count-1, none present. O(tile_count), the only allocation.
  explicit TileTable(std::size_t tile_count) : tiles_(tile_count, nullptr) {}

  const Tile* find(TileId tile) const noexcept { return tile < tiles_.size() ? tiles_[tile] : nullptr; }
  std::size_t size() const noexcept { return size_; }
  // Grows with every add() and retire(): while it stays the same, so do all answers of find().
  std::uint64_t changes() const noexcept { return changes_; }
  // The table does not own the tile: who sent it frees it after the reader has said that it let go.
  void add(const Tile& tile) noexcept {
    ++changes_;
    size_ += tiles_[tile.id()] == nullptr;
    tiles_[tile.id()] = &tile;
  }
  void retire(TileId tile) noexcept {
    ++changes_;
    size_ -= tiles_[tile] != nullptr;
    tiles_[tile] = nullptr;
  }

 private:
  std::vector<const Tile*> tiles_;
  std::size_t size_ = 0;
  std::uint64_t changes_ = 0;
};

}  // namespace filiform
