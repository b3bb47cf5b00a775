// The part of TileLoader for its readers, and for many hands at one table.
#include "index/streaming/internal/tile_loader.h"

#include <algorithm>
#include <list>
#include <memory>

namespace filiform::internal {

TileReader& TileLoader::addReader() {
  Peer& peer = peers_.emplace_back(std::make_unique<TileChannel>(store_.tile_count()));
  ++readers_;
  for (TileSlot* const slot : slots_.all()) {
    if (!slot->inMemory()) continue;
    ++slot->adds_left;
    slot->state = TileState::ready;
    peer.outbox.push_back({slot->tile.get(), slot->id});
  }
  flush();
  return *peer.reader;
}

TileFocus& TileLoader::addFocus() { return *peers_.emplace_back(std::make_unique<FocusChannel<TileFocus>>()).hand; }

void TileLoader::removeFocus(const TileFocus& focus) {
  std::erase_if(peers_, [&](const Peer& p) { return p.hand.get() == &focus; });
  stale_ = true;
}

double TileLoader::crowdRest() const {
  constexpr double kRestOfOne_s = 0.0002;
  return pace_.is_real ? kRestOfOne_s * static_cast<double>(peers_.size() - readers_) : 0;
}

std::uint64_t TileLoader::partOf(const Peer& p) const {
  return p.reader ? options_.budget_bytes : options_.budget_bytes / std::max<std::size_t>(peers_.size() - readers_, 1);
}

}  // namespace filiform::internal
