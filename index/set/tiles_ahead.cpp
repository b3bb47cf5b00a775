#include "index/set/tiles_ahead.h"

#include "index/remote/internal/background_reads.h"
#include "index/set/reads_at_once.h"

#include <algorithm>
#include <utility>

namespace filiform {

TilesAhead::TilesAhead(const TileStore& store, std::vector<TileId> tiles, bool with_appearance, Reads reads,
                       unsigned threads)
    : store_(store), tiles_(std::move(tiles)), with_appearance_(with_appearance), reads_(reads) {
  most_ahead_ = std::min<std::size_t>(kRemoteTiles, readsAtOnce(store));
  if (store.isRemote() || threads < 2) return;
  decode_.emplace(threads);
  most_ahead_ = 2 * std::size_t{threads};
}

TilesAhead::Loaded TilesAhead::load(TileId tile) const {
  return {store_.load(tile), with_appearance_ ? store_.loadAppearance(tile) : TileAppearance{}};
}

TilesAhead::Loaded TilesAhead::next() {
  if (most_ahead_ == 1) return load(tiles_[begun_++]);
  ReadThreads* const threads = decode_ ? &*decode_ : &readThreads();
  const bool is_bulk = reads_ == Reads::background;
  while (begun_ < tiles_.size() && pending_.size() < most_ahead_) {
    const TileId tile = tiles_[begun_++];
    Pending& pending = pending_.emplace_back();
    pending.tile = FutureRead<std::shared_ptr<const Tile>>(threads, [&store = store_, tile, is_bulk] {
      const internal::BackgroundReads background(is_bulk);
      return store.load(tile);
    });
    if (!with_appearance_) continue;
    pending.appearance = FutureRead<TileAppearance>(threads, [&store = store_, tile, is_bulk] {
      const internal::BackgroundReads background(is_bulk);
      return store.loadAppearance(tile);
    });
  }
  Pending first = std::move(pending_.front());
  pending_.pop_front();
  Loaded loaded;
  loaded.tile = first.tile.get();
  if (with_appearance_) loaded.appearance = first.appearance.get();
  return loaded;
}

}  // namespace filiform
