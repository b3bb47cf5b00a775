// KeptTiles: a tile store that keeps the tiles and the details of cells used last in memory, for work that asks for the
// same ones again and again, such as readCell() for one cell after the other.
//
//   const KeptTiles kept(*set, 64 << 20);
//   for (const std::uint32_t cell : cells) use(readCell(kept, cell, true));
#pragma once

#include "index/set/forwarding_store.h"

#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <unordered_map>

namespace filiform {

// Thread rule: internally synchronised. Two threads that need the same tile at once may both read it.
class KeptTiles final : public ForwardingStore {
 public:
  // Keeps tiles, appearances and details up to this many bytes in memory. The store must outlive this object.
  KeptTiles(const TileStore& store, std::uint64_t budget_bytes) : ForwardingStore(store), budget_bytes_(budget_bytes) {}

  std::shared_ptr<const Tile> load(TileId tile) const override;
  TileAppearance loadAppearance(TileId tile) const override { return *appearance(tile); }
  std::shared_ptr<const TileAppearance> appearance(TileId tile) const;  // without a copy
  CellDetail loadCellDetail(std::uint32_t id) const override;
  void setBudget(std::uint64_t budget_bytes);
  std::uint64_t bytes() const;  // kept now

 private:
  struct Kept {
    std::uint64_t key;                 // a tile's number; kCell plus a cell's
    std::shared_ptr<const Tile> tile;  // one of the two, or both
    std::shared_ptr<const TileAppearance> appearance;
    std::shared_ptr<const CellDetail> detail;
    std::uint64_t bytes = 0;
  };
  static constexpr std::uint64_t kCell = std::uint64_t{1} << 32;
  // The entry of the key, now the most recent; a new one if there is none. The caller holds the mutex.
  Kept& use(std::uint64_t key) const;
  void grow(Kept& kept, std::uint64_t bytes) const;
  void trim() const;

  std::uint64_t budget_bytes_;  // under the mutex
  mutable std::mutex mutex_;
  mutable std::list<Kept> order_;  // most recent first
  mutable std::unordered_map<std::uint64_t, std::list<Kept>::iterator> places_;
  mutable std::uint64_t bytes_ = 0;
};

}  // namespace filiform
