// TileCache: the most recently used tiles of a store with their search engines, within a byte budget. Thread rule:
// internally synchronised.
#pragma once

#include "index/errors.h"
#include "index/query/nearest.h"
#include "index/tile/tile_engine.h"
#include "index/workers.h"

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <deque>
#include <list>
#include <memory>
#include <mutex>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

namespace filiform::internal {

struct SearchTile {
  std::shared_ptr<const Tile> tile;
  std::unique_ptr<const TileEngine> engine;
  std::uint64_t bytes;
};

class TileCache {
 public:
  TileCache(const TileStore& store, const NearestOptions& options) : store_(store), options_(options) {}

  std::shared_ptr<const SearchTile> find(TileId tile) {
    const std::lock_guard lock(mutex_);
    const auto at = tiles_.find(tile);
    if (at == tiles_.end()) return nullptr;
    order_.splice(order_.begin(), order_, at->second.place);
    return at->second.loaded;
  }

  // Reads without the lock: two threads may read the same tile, and one copy is kept.
  std::shared_ptr<const SearchTile> get(TileId tile, std::uint32_t& reads) {
    if (auto found = find(tile)) return found;
    auto loaded = std::make_shared<SearchTile>();
    loaded->tile = takeAhead(tile);
    if (loaded->tile == nullptr) loaded->tile = store_.load(tile);
    ++reads;
    loaded->engine = makeTileEngine(options_.engine, loaded->tile);
    loaded->bytes = loaded->tile->bytes() + loaded->engine->bytes();
    const std::lock_guard lock(mutex_);
    const auto [at, fresh] = tiles_.try_emplace(tile);
    if (fresh) {
      order_.push_front(tile);
      at->second = {loaded, order_.begin()};
      bytes_ += loaded->bytes;
      trim();
    }
    return loaded;
  }

  // Reads those of the tiles that are not here, all at once. They count as read when get() takes them, so that results
  // do not depend on where the set is. A tile that cannot be read is left to get().
  void readAhead(std::span<const TileId> tiles) {
    std::vector<TileId> absent;
    {
      const std::lock_guard lock(mutex_);
      for (const TileId tile : tiles)
        if (!tiles_.contains(tile) && aheadOf(tile) == ahead_.end()) absent.push_back(tile);
    }
    if (absent.size() < 2) return;
    std::vector<std::shared_ptr<const Tile>> read(absent.size());
    std::atomic<std::size_t> next{0};
    runWorkers(absent.size(), [&](unsigned, const std::atomic<bool>&) {
      for (std::size_t i; (i = next.fetch_add(1)) < absent.size();) {
        try {
          read[i] = store_.load(absent[i]);
        } catch (const Error&) {
        }
      }
    });
    const std::lock_guard lock(mutex_);
    for (std::shared_ptr<const Tile>& tile : read)
      if (tile != nullptr) ahead_.push_back(std::move(tile));
    while (ahead_.size() > kMostAhead) ahead_.pop_front();
  }

  std::vector<TileId> resident() const {
    const std::lock_guard lock(mutex_);
    std::vector<TileId> tiles(order_.begin(), order_.end());
    std::sort(tiles.begin(), tiles.end());
    return tiles;
  }

  std::uint64_t bytes() const {
    const std::lock_guard lock(mutex_);
    return bytes_;
  }

 private:
  struct Slot {
    std::shared_ptr<const SearchTile> loaded;
    std::list<TileId>::iterator place;
  };

  static constexpr std::size_t kMostAhead = 32;

  std::deque<std::shared_ptr<const Tile>>::iterator aheadOf(TileId tile) {
    return std::find_if(ahead_.begin(), ahead_.end(), [&](const auto& read) { return read->id() == tile; });
  }

  std::shared_ptr<const Tile> takeAhead(TileId tile) {
    const std::lock_guard lock(mutex_);
    const auto at = aheadOf(tile);
    if (at == ahead_.end()) return nullptr;
    std::shared_ptr<const Tile> taken = std::move(*at);
    ahead_.erase(at);
    return taken;
  }

  void trim() {
    for (auto last = order_.end(); bytes_ > options_.budget_bytes && last != order_.begin();) {
      --last;
      if (*last == store_.long_tile()) continue;
      const auto at = tiles_.find(*last);
      bytes_ -= at->second.loaded->bytes;
      tiles_.erase(at);
      last = order_.erase(last);
    }
  }

  const TileStore& store_;
  const NearestOptions options_;
  mutable std::mutex mutex_;
  std::list<TileId> order_;  // most recent first
  std::unordered_map<TileId, Slot> tiles_;
  std::uint64_t bytes_ = 0;
  std::deque<std::shared_ptr<const Tile>> ahead_;  // read ahead and not used yet
};

}  // namespace filiform::internal
