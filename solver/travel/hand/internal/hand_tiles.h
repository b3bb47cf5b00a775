// The source of the hand's tiles. There are four kinds:
//   resident   a Residency loads tiles within a budget, in virtual or real time
//   shared     like resident, with the residency and the table of a host that serves many hands
//   held       all tiles are in memory (a small scene)
//   replay     a recording is replayed: each tile is loaded when it is first needed. The tiles that the recorded tick
//              met absent are hidden while the tick is repeated.
// Thread rule: the constructor, loadTogether(), hide(), show() and use() belong to one owner, while no other thread
// uses the table. For concurrent use, see TileReader and Residency.
#pragma once

#include "index/set/tile_store.h"
#include "index/streaming/residency.h"
#include "index/streaming/tile_table.h"
#include "solver/travel/hand/shared_tiles.h"

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace filiform::internal {

enum class TileKind : std::uint8_t { resident, shared, held, replay };

class HandTiles {
 public:
  // Loads all tiles (held), or only the long-segment tile. The store must outlive the object. Throws UsageError for a
  // budget below the minimum (resident); CorruptTile and IoError from the store.
  // `shared`: the tiles of the host, which must outlive the object; only for the kind `shared`.
  HandTiles(const TileStore& store, TileKind kind, const ResidencyOptions& options, const SharedTiles& shared = {});
  ~HandTiles();
  HandTiles(const HandTiles&) = delete;
  HandTiles& operator=(const HandTiles&) = delete;

  const TileTable& table() const { return table_ ? *table_ : reader_->tiles(); }
  Residency* residency() { return residency_; }              // nullptr unless resident or shared
  const Residency* residency() const { return residency_; }  // likewise
  // For the haptic thread. reader(): whose messages it takes; nullptr unless resident. focus(): nullptr unless resident
  // or shared.
  TileReader* reader() { return kind_ == TileKind::resident ? reader_ : nullptr; }
  TileFocus* focus() { return focus_; }

  // In virtual time: makes all of `tiles` present at once. Returns false if they do not fit the budget together. Hidden
  // tiles stay absent. Throws CorruptTile or IoError for a tile that cannot be read.
  bool loadTogether(std::span<const TileId> tiles);
  // loadTogether() may evict tiles that were not requested.
  bool mayEvict() const;

  // Makes these tiles absent until show(). Ids out of range are ignored. Has no effect on resident tiles.
  void hide(std::span<const std::uint32_t> tiles);
  bool hides(TileId tile) const;
  void show();

  struct Use {
    std::uint64_t reads = 0, evictions = 0, peak_bytes = 0;  // bytes: of decoded tiles
    ResidencyCounters streaming;                             // resident only
    std::vector<std::string> failures;                       // resident only, see Residency::failures()
  };
  Use use() const;

 private:
  void hold(TileId tile);
  void makeRoom(std::span<const TileId> wanted);

  const TileStore& store_;
  TileKind kind_;
  std::uint64_t budget_bytes_;
  std::vector<std::shared_ptr<const Tile>> tiles_;  // by id; unless resident
  std::vector<TileId> hidden_;
  std::uint64_t bytes_ = 0, peak_bytes_ = 0, reads_ = 0;
  std::unique_ptr<TileTable> table_;          // unless resident or shared
  std::unique_ptr<Residency> own_residency_;  // resident only
  Residency* residency_ = nullptr;
  TileReader* reader_ = nullptr;
  TileFocus* focus_ = nullptr;
};

}  // namespace filiform::internal
