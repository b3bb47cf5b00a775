// The part of TileLoader that evicts tiles, the least urgent first.
#include "index/streaming/internal/tile_loader.h"

namespace filiform::internal {

// The least urgent claim is evicted first; among tiles without a claim, the one that lost its claim first.
bool TileLoader::goesLater(const TileSlot* a, const TileSlot* b) {
  if (a->order != b->order) return a->order < b->order;
  return a->last_claimed != b->last_claimed ? a->last_claimed > b->last_claimed : a->id > b->id;
}

void TileLoader::release(TileSlot& slot) {
  counters_.bytes -= bytesOf(slot.id);
  leaving_ -= bytesOf(slot.id);
  stale_ |= slot.wanted;
  slots_.erase(slot);
}

void TileLoader::retire(TileSlot& slot) {
  slot.state = TileState::retiring;
  std::erase(unwanted_, &slot);
  counters_.prefetch_wasted += slot.foreseen;
  evicted_[slot.id] = true;
  slot.retires_left = readers_;
  loaded_.retire(slot.id);
  leaving_ += bytesOf(slot.id);
  ++counters_.evictions;
  if (readers_ == 0) {
    release(slot);
  } else {
    send({nullptr, slot.id});
  }
}

TileSlot* TileLoader::victim(const MayGo& may_go) {
  if (!may_go) {
    for (std::size_t i = unwanted_.size(); i-- > 0;)
      if (!pinned(unwanted_[i]->id)) return unwanted_[i];
    return nullptr;
  }
  TileSlot* worst = nullptr;
  for (TileSlot* const slot : slots_.all())
    if (slot->inMemory() && !pinned(slot->id) && may_go(*slot) && (worst == nullptr || goesLater(worst, slot)))
      worst = slot;
  return worst;
}

bool TileLoader::makeRoom(std::uint64_t need, bool at_once, const MayGo& may_go) {
  while (counters_.bytes - leaving_ + reserved_ + need > options_.budget_bytes) {
    TileSlot* const slot = victim(may_go);
    if (slot == nullptr) return false;
    retire(*slot);
    if (at_once) settle();
  }
  return counters_.bytes + reserved_ + need <= options_.budget_bytes;
}

}  // namespace filiform::internal
