// The loader's data for every tile that is not simply absent, by tile, in a pool with stable addresses. Thread rule:
// thread-compatible.
#pragma once

#include "index/streaming/residency_options.h"
#include "index/tile/tile.h"

#include <cstdint>
#include <deque>
#include <limits>
#include <memory>
#include <vector>

namespace filiform::internal {

struct TileSlot {
  static constexpr std::size_t kUnclaimed = std::numeric_limits<std::size_t>::max();

  TileId id = kNoTile;
  TileState state = TileState::absent;
  std::shared_ptr<const Tile> tile;
  std::size_t adds_left = 0, retires_left = 0;  // acknowledgements still missing
  std::size_t order = kUnclaimed;               // position among the claims of the last plan
  bool wanted = false;                          // by the last plan: fits the budget with all more urgent claims
  std::uint64_t last_claimed = 0;               // number of the plan
  double due = 0;                               // queued: earliest time of the read
  double queued_at = 0;
  bool ahead = false;             // claimed along the neurite: its content shows where the neurite continues
  bool foreseen = false;          // read without request, and neither entered nor requested since
  bool held_once = false;         // every reader held it at some time
  double retry = 0, backoff = 0;  // failed: earliest time of the next attempt

  bool inMemory() const { return state == TileState::ready || state == TileState::resident; }

 private:
  friend class TileSlots;
  std::size_t listed_at_ = 0;
};

class TileSlots {
 public:
  explicit TileSlots(std::size_t tile_count) : place_(tile_count, kNone) {}

  // nullptr if there is none. Valid until the slot is erased. All O(1).
  TileSlot* find(TileId tile) { return place_[tile] == kNone ? nullptr : &pool_[place_[tile]]; }
  const TileSlot* find(TileId tile) const { return place_[tile] == kNone ? nullptr : &pool_[place_[tile]]; }
  TileSlot& operator[](TileId tile) {
    if (place_[tile] != kNone) return pool_[place_[tile]];
    if (free_.empty()) {
      free_.push_back(static_cast<std::uint32_t>(pool_.size()));
      pool_.emplace_back();
    }
    place_[tile] = free_.back();
    free_.pop_back();
    TileSlot& slot = pool_[place_[tile]];
    slot.id = tile;
    slot.listed_at_ = list_.size();
    list_.push_back(&slot);
    return slot;
  }
  void erase(TileSlot& slot) {
    list_.back()->listed_at_ = slot.listed_at_;
    list_[slot.listed_at_] = list_.back();
    list_.pop_back();
    free_.push_back(place_[slot.id]);
    place_[slot.id] = kNone;
    slot = TileSlot{};
  }
  // All slots, in an arbitrary but deterministic order. Erasing a slot moves the last one to its position.
  const std::vector<TileSlot*>& all() const { return list_; }

 private:
  static constexpr std::uint32_t kNone = UINT32_MAX;
  std::vector<std::uint32_t> place_;  // by tile: position in the pool
  std::deque<TileSlot> pool_;
  std::vector<std::uint32_t> free_;
  std::vector<TileSlot*> list_;
};

}  // namespace filiform::internal
