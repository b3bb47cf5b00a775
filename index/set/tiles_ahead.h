// TilesAhead: loads tiles in a given order, for work that visits many tiles one after the other. From a set at an
// address it loads several at once, before they are taken; from a folder, only with several threads.
//
//   TilesAhead ahead(store, tiles, true);
//   for (std::size_t i = 0; i < tiles.size(); ++i) use(ahead.next());
#pragma once

#include "index/file/future_read.h"
#include "index/set/tile_store.h"

#include <cstddef>
#include <deque>
#include <memory>
#include <optional>
#include <vector>

namespace filiform {

// Thread rule: thread-compatible. Its destructor waits for the loads under way.
class TilesAhead {
 public:
  static constexpr std::size_t kRemoteTiles = 32;  // in memory at once, or under way

  struct Loaded {
    std::shared_ptr<const Tile> tile;
    TileAppearance appearance;  // empty unless asked for
  };

  enum class Reads {
    background,  // bulk work: never delays the reads for a moving hand
    awaited      // a user waits for it
  };

  // The store must outlive this object. `threads`: that decode tiles of a set in a folder; with two or more, up to two
  // tiles a thread are in memory before they are taken.
  TilesAhead(const TileStore& store, std::vector<TileId> tiles, bool with_appearance, Reads reads = Reads::background,
             unsigned threads = 1);

  // The next tile. Throws what the store throws. Requires that not all tiles were taken.
  Loaded next();

 private:
  struct Pending {
    FutureRead<std::shared_ptr<const Tile>> tile;
    FutureRead<TileAppearance> appearance;
  };
  Loaded load(TileId tile) const;

  const TileStore& store_;
  const std::vector<TileId> tiles_;
  const bool with_appearance_;
  const Reads reads_;
  std::size_t begun_ = 0;
  std::size_t most_ahead_;             // 1: nothing is loaded ahead
  std::optional<ReadThreads> decode_;  // of a set in a folder
  std::deque<Pending> pending_;
};

}  // namespace filiform
