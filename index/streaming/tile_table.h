// The tiles that one reader may use now. Each reader (haptic loop, viewer, jump resolver) owns a table. It changes the
// table only between its own ticks, when it takes messages from the loader. So a tick needs no lock, allocation or
// reference count. Thread rule: owned by one thread.
#pragma once

#include "index/tile/tile.h"

#include <vector>

namespace filiform {

class TileTable {
 public:
  // A table for tile ids 0 .. tile_count-1, all absent. O(tile_count); the only allocation.
  explicit TileTable(std::size_t tile_count) : tiles_(tile_count, nullptr) {}

  // The tile, or nullptr if it is absent.
  const Tile* find(TileId tile) const noexcept { return tile < tiles_.size() ? tiles_[tile] : nullptr; }
  std::size_t size() const noexcept { return size_; }
  // Grows with every add() and retire(). As long as the number is the same, find() gives the same answers.
  std::uint64_t changes() const noexcept { return changes_; }
  // Adds a tile. The loader owns the tile and frees it after the reader acknowledges its removal.
  void add(const Tile& tile) noexcept {
    ++changes_;
    size_ += tiles_[tile.id()] == nullptr;
    tiles_[tile.id()] = &tile;
  }
  // Removes a tile.
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
