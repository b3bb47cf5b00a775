// The part of TileLoader for tiles that are held in addition to what readers work on.
#include "index/streaming/internal/tile_loader.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace filiform::internal {

HoldId TileLoader::hold(std::span<const TileId> tiles, HoldKind kind) {
  Hold hold{{}, kind, plan_number_};
  for (const TileId tile : tiles)
    if (tile < store_.tile_count()) hold.tiles.push_back(tile);
  holds_.emplace(next_hold_, std::move(hold));
  stale_ = urgent_ = true;
  return next_hold_++;
}

void TileLoader::releaseHold(HoldId hold) { stale_ |= holds_.erase(hold) > 0; }

bool TileLoader::isHeld(HoldId id) const {
  const auto found = holds_.find(id);
  if (found == holds_.end()) return false;
  const Hold& hold = found->second;
  for (std::size_t i = 0; i < hold.tiles.size(); ++i) {
    const TileSlot* const slot = slots_.find(hold.tiles[i]);
    if (slot != nullptr && slot->state == TileState::resident) continue;
    const bool no_room = i > 0 && plan_number_ > hold.made_in_plan && (slot == nullptr || !slot->wanted);
    if (!no_room) return false;
  }
  return true;
}

void TileLoader::claimHolds() {
  double order = 0;
  pages_.setCost(0);
  for (const auto& [id, hold] : holds_)
    for (const TileId tile : hold.tiles) {
      double cost = ++order;
      if (hold.kind == HoldKind::cell) {
        cost = std::numeric_limits<double>::infinity();
        for (const Peer& p : peers_)
          if (p.has_focus && p.focus.p_W.allFinite()) cost = std::min(cost, prefetch_.distance_um(tile, p.focus.p_W));
      }
      claims_.push_back({tile, hold.kind == HoldKind::target ? Rank::target : Rank::kept, cost});
    }
}

}  // namespace filiform::internal
