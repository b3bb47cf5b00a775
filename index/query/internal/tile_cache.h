// TileCache: the tiles of a store that were searched lately, with their search engines, within a byte budget. A tile
// that is here is found without a lock. Thread rule: internally synchronised.
#pragma once

#include "index/errors.h"
#include "index/set/tile_store.h"
#include "index/tile/tile_engine.h"
#include "index/workers.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace filiform::internal {

struct SearchTile {
  std::shared_ptr<const Tile> tile;
  std::unique_ptr<const TileEngine> engine;
  std::uint64_t bytes;
};

class TileCache {
  struct Slot {
    std::atomic<const SearchTile*> tile{nullptr};
    std::atomic<std::uint32_t> leases{0};
    std::atomic<bool> used{false};  // since trim() saw it last
  };

 public:
  // `engine`: see makeTileEngine().
  TileCache(const TileStore& store, std::string engine, std::uint64_t budget_bytes)
      : store_(store),
        engine_(std::move(engine)),
        budget_bytes_(budget_bytes),
        pages_(store.tile_count() / kPageSlots + 1) {}
  ~TileCache() {
    for (const TileId tile : order_) delete slotOf(tile)->tile.load();
    for (const std::atomic<Page*>& page : pages_) delete page.load();
  }
  TileCache(const TileCache&) = delete;
  TileCache& operator=(const TileCache&) = delete;

  // A tile that stays in memory as long as the lease lives. Empty if the tile was not there.
  class Lease {
   public:
    Lease() = default;
    Lease(Lease&& other) noexcept : slot_(std::exchange(other.slot_, nullptr)), tile_(other.tile_) {}
    Lease& operator=(Lease&&) = delete;
    ~Lease() {
      if (slot_ != nullptr) slot_->leases.fetch_sub(1, std::memory_order_release);
    }
    explicit operator bool() const { return slot_ != nullptr; }
    const SearchTile* operator->() const { return tile_; }

   private:
    friend class TileCache;
    Lease(Slot& slot, const SearchTile* tile) : slot_(&slot), tile_(tile) {}
    Slot* slot_ = nullptr;
    const SearchTile* tile_ = nullptr;
  };

  Lease find(TileId tile) {
    Slot* const slot = slotOf(tile);
    if (slot == nullptr || slot->tile.load(std::memory_order_relaxed) == nullptr) return {};
    // drop() clears the pointer and then reads the leases: with this order, it sees the lease or this sees no tile.
    slot->leases.fetch_add(1);
    const SearchTile* const there = slot->tile.load();
    Lease lease(*slot, there);
    if (there == nullptr) return {};
    if (!slot->used.load(std::memory_order_relaxed)) slot->used.store(true, std::memory_order_relaxed);
    return lease;
  }

  // Reads without the lock: two threads may read the same tile, and one copy is kept.
  Lease get(TileId tile, std::uint32_t& reads) {
    if (Lease found = find(tile)) return found;
    auto read = std::make_unique<SearchTile>();
    read->tile = takeAhead(tile);
    if (read->tile == nullptr) read->tile = store_.load(tile);
    ++reads;
    read->engine = makeTileEngine(engine_, read->tile);
    read->bytes = read->tile->bytes() + read->engine->bytes();
    const std::lock_guard lock(mutex_);
    Slot& slot = madeSlot(tile);
    if (slot.tile.load() == nullptr) {
      order_.push_back(tile);
      bytes_ += read->bytes;
      slot.used.store(false);
      slot.tile.store(read.release());
    }
    slot.leases.fetch_add(1);
    Lease lease(slot, slot.tile.load());
    trim();
    return lease;
  }

  // Reads those of the tiles that are not here, all at once. They count as read when get() takes them, so that results
  // do not depend on where the set is. A tile that cannot be read is left to get().
  void readAhead(std::span<const TileId> tiles) {
    std::vector<TileId> absent;
    {
      const std::lock_guard lock(mutex_);
      for (const TileId tile : tiles)
        if (!isHere(tile) && aheadOf(tile) == ahead_.end()) absent.push_back(tile);
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

  bool isHere(TileId tile) const {
    const Slot* const slot = slotOf(tile);
    return slot != nullptr && slot->tile.load(std::memory_order_relaxed) != nullptr;
  }

  // The tiles here, ascending.
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
  static constexpr std::size_t kMostAhead = 32;
  static constexpr TileId kPageSlots = 256;
  using Page = std::array<Slot, kPageSlots>;

  // Null if no tile near it was ever here.
  Slot* slotOf(TileId tile) const {
    Page* const page = pages_[tile / kPageSlots].load(std::memory_order_acquire);
    return page == nullptr ? nullptr : &(*page)[tile % kPageSlots];
  }
  Slot& madeSlot(TileId tile) {
    std::atomic<Page*>& page = pages_[tile / kPageSlots];
    if (page.load() == nullptr) page.store(new Page);
    return (*page.load())[tile % kPageSlots];
  }

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

  // The oldest go first; those used since the last time get a second turn. Amortised O(1).
  void trim() {
    for (std::size_t turns = 2 * order_.size(); bytes_ > budget_bytes_ && turns > 0; --turns) {
      const TileId oldest = order_.front();
      order_.pop_front();
      if (oldest == store_.long_tile() || slotOf(oldest)->used.exchange(false))
        order_.push_back(oldest);
      else
        drop(*slotOf(oldest));
    }
    std::erase_if(dropped_, [](const auto& one) { return one.first->leases.load() == 0; });
  }
  void drop(Slot& slot) {
    dropped_.emplace_back(&slot, nullptr);
    dropped_.back().second.reset(slot.tile.exchange(nullptr));
    bytes_ -= dropped_.back().second->bytes;
  }

  const TileStore& store_;
  const std::string engine_;
  const std::uint64_t budget_bytes_;
  std::vector<std::atomic<Page*>> pages_;
  mutable std::mutex mutex_;
  std::deque<TileId> order_;                                                  // the oldest first
  std::vector<std::pair<Slot*, std::unique_ptr<const SearchTile>>> dropped_;  // perhaps still leased
  std::uint64_t bytes_ = 0;
  std::deque<std::shared_ptr<const Tile>> ahead_;  // read ahead and not used yet
};

}  // namespace filiform::internal
