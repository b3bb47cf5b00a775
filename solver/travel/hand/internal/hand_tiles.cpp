#include "solver/travel/hand/internal/hand_tiles.h"

#include <algorithm>

namespace filiform::internal {

HandTiles::HandTiles(const TileStore& store, TileKind kind, const ResidencyOptions& options, const SharedTiles& shared)
    : store_(store), kind_(kind), budget_bytes_(options.budget_bytes) {
  if (kind == TileKind::resident) {
    own_residency_ = std::make_unique<Residency>(store, options);
    residency_ = own_residency_.get();
    reader_ = &residency_->addReader("haptic loop");
    focus_ = reader_;
    return;
  }
  if (kind == TileKind::shared) {
    residency_ = shared.residency;
    reader_ = shared.reader;
    focus_ = &residency_->addFocus();
    return;
  }
  tiles_.resize(store.tile_count());
  table_ = std::make_unique<TileTable>(store.tile_count());
  if (kind == TileKind::held)
    for (TileId tile = 0; tile < store.tile_count(); ++tile) hold(tile);
  else if (store.long_tile() != kNoTile)
    hold(store.long_tile());
}

HandTiles::~HandTiles() {
  if (kind_ == TileKind::shared) residency_->removeFocus(*focus_);
}

bool HandTiles::loadTogether(std::span<const TileId> tiles) {
  switch (kind_) {
    case TileKind::resident:
      if (residency_->loadTogether(tiles)) return true;
      for (const TileId tile : tiles)
        if (residency_->state(tile) == TileState::failed) store_.load(tile);  // throws the reason
      return false;
    case TileKind::shared:
    case TileKind::held:
      return false;
    case TileKind::replay:
      makeRoom(tiles);
      for (const TileId tile : tiles) hold(tile);
      return true;
  }
  return false;
}

bool HandTiles::mayEvict() const {
  return kind_ == TileKind::resident || (kind_ == TileKind::replay && budget_bytes_ != UINT64_MAX);
}

void HandTiles::hide(std::span<const std::uint32_t> tiles) {
  if (!table_) return;
  hidden_.assign(tiles.begin(), tiles.end());
  for (const TileId tile : hidden_)
    if (tile < tiles_.size()) table_->retire(tile);
}

bool HandTiles::hides(TileId tile) const { return std::find(hidden_.begin(), hidden_.end(), tile) != hidden_.end(); }

void HandTiles::show() {
  for (const TileId tile : hidden_)
    if (tile < tiles_.size() && tiles_[tile]) table_->add(*tiles_[tile]);
  hidden_.clear();
}

HandTiles::Use HandTiles::use() const {
  if (residency_ == nullptr) return {reads_, 0, peak_bytes_, {}, {}};
  const ResidencyCounters counters = residency_->counters();
  return {counters.reads, counters.evictions, counters.peak_bytes, counters, residency_->failures()};
}

void HandTiles::hold(TileId tile) {
  if (tiles_[tile]) return;
  tiles_[tile] = store_.load(tile);
  reads_ += kind_ == TileKind::replay;
  bytes_ += store_.entry(tile).decoded_bytes;
  peak_bytes_ = std::max(peak_bytes_, bytes_);
  if (!hides(tile)) table_->add(*tiles_[tile]);
}

// If the budget is exceeded, drops all tiles that are not wanted now. This is rare, so a simple rule is enough.
void HandTiles::makeRoom(std::span<const TileId> wanted) {
  std::uint64_t more = 0;
  for (const TileId tile : wanted) more += tiles_[tile] ? 0 : store_.entry(tile).decoded_bytes;
  if (bytes_ + more <= budget_bytes_) return;
  for (TileId tile = 0; tile < tiles_.size(); ++tile) {
    if (!tiles_[tile] || tile == store_.long_tile() || std::find(wanted.begin(), wanted.end(), tile) != wanted.end())
      continue;
    table_->retire(tile);
    tiles_[tile].reset();
    bytes_ -= store_.entry(tile).decoded_bytes;
  }
}

}  // namespace filiform::internal
