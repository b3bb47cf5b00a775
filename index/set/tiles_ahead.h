// TilesAhead: loads tiles in a given order, for work that visits many tiles one after the other. From a set at an
// address it loads several at once, before they are taken.
//
//   TilesAhead ahead(store, tiles, true);
//   for (std::size_t i = 0; i < tiles.size(); ++i) use(ahead.next());
#pragma once

#include "index/file/future_read.h"
#include "index/set/tile_store.h"

#include <cstddef>
#include <deque>
#include <memory>
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

  // The store must outlive this object.
  TilesAhead(const TileStore& store, std::vector<TileId> tiles, bool with_appearance, Reads reads = Reads::background);

  // The next tile. Throws what the store throws. Requires that not all tiles were taken.
  Loaded next();

 private:
  struct Pending {
    FutureRead<std::shared_ptr<const Tile>> tile;
    FutureRead<TileAppearance> appearance;
  };
  const TileStore& store_;
  const std::vector<TileId> tiles_;
  const bool with_appearance_;
  const Reads reads_;
  std::size_t begun_ = 0;
  std::deque<Pending> pending_;
};

}  // namespace filiform
