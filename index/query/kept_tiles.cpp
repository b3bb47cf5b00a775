#include "index/query/kept_tiles.h"

namespace filiform {

KeptTiles::Kept& KeptTiles::use(std::uint64_t key) const {
  const auto [at, is_new] = places_.try_emplace(key);
  if (is_new) {
    order_.push_front({key, nullptr, nullptr, nullptr});
    at->second = order_.begin();
  } else {
    order_.splice(order_.begin(), order_, at->second);
  }
  return order_.front();
}

void KeptTiles::grow(Kept& kept, std::uint64_t bytes) const {
  kept.bytes += bytes;
  bytes_ += bytes;
  trim();
}

void KeptTiles::setBudget(std::uint64_t budget_bytes) {
  const std::lock_guard lock(mutex_);
  budget_bytes_ = budget_bytes;
  trim();
}

void KeptTiles::trim() const {
  while (bytes_ > budget_bytes_) {
    bytes_ -= order_.back().bytes;
    places_.erase(order_.back().key);
    order_.pop_back();
  }
}

std::shared_ptr<const Tile> KeptTiles::load(TileId tile) const {
  {
    const std::lock_guard lock(mutex_);
    if (places_.contains(tile))
      if (const Kept& kept = use(tile); kept.tile != nullptr) return kept.tile;
  }
  std::shared_ptr<const Tile> loaded = store_.load(tile);
  const std::lock_guard lock(mutex_);
  Kept& kept = use(tile);
  if (kept.tile != nullptr) return kept.tile;
  kept.tile = loaded;
  grow(kept, loaded->bytes());
  return loaded;
}

std::shared_ptr<const TileAppearance> KeptTiles::appearance(TileId tile) const {
  {
    const std::lock_guard lock(mutex_);
    if (places_.contains(tile))
      if (const Kept& kept = use(tile); kept.appearance != nullptr) return kept.appearance;
  }
  auto loaded = std::make_shared<const TileAppearance>(store_.loadAppearance(tile));
  const std::lock_guard lock(mutex_);
  Kept& kept = use(tile);
  if (kept.appearance != nullptr) return kept.appearance;
  kept.appearance = loaded;
  grow(kept, loaded->radii_um.size() * sizeof(float) + loaded->types.size() * sizeof(std::uint16_t));
  return loaded;
}

CellDetail KeptTiles::loadCellDetail(std::uint32_t id) const {
  std::shared_ptr<const CellDetail> loaded;  // copied without the lock
  {
    const std::lock_guard lock(mutex_);
    if (places_.contains(kCell + id)) loaded = use(kCell + id).detail;
  }
  if (loaded != nullptr) return *loaded;
  loaded = std::make_shared<const CellDetail>(store_.loadCellDetail(id));
  const std::lock_guard lock(mutex_);
  Kept& kept = use(kCell + id);
  if (kept.detail != nullptr) return *loaded;
  kept.detail = loaded;
  grow(kept, sizeof *loaded + loaded->sample_ids.bytes() + loaded->header.size() +
                 loaded->roots.size() * sizeof(CellDetail::Root) +
                 loaded->odd_radii.size() * sizeof(CellDetail::OddBits) +
                 (loaded->tiles.size() + loaded->block_starts.size()) * sizeof(std::uint32_t));
  return *loaded;
}

std::uint64_t KeptTiles::bytes() const {
  const std::lock_guard lock(mutex_);
  return bytes_;
}

}  // namespace filiform
