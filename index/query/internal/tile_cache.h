// TileCache: the tiles of a store that were searched lately, with their search engines, within a byte budget. A tile
// that is here is found without a lock. Thread rule: internally synchronised.
#pragma once

#include "index/errors.h"
#include "index/file/future_read.h"
#include "index/query/internal/segment_sieve.h"
#include "index/set/reads_at_once.h"
#include "index/set/tile_store.h"
#include "index/tile/tile_engine.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <iterator>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

namespace filiform::internal {

struct SearchTile {
  std::shared_ptr<const Tile> tile;
  std::shared_ptr<const TileEngine> engine;         // over the wanted segments
  std::shared_ptr<const TileEngine> ghosts;         // over ghosts that may be wanted; null: there are none
  std::shared_ptr<const std::vector<bool>> wanted;  // by segment, of owned ones; null without a filter of types
  std::uint64_t bytes;
};

struct Everywhere final : Region {
  bool mayMeet(const WorldBox&) const noexcept override { return true; }
};

class TileCache {
  struct Slot {
    std::atomic<const SearchTile*> tile{nullptr};
    std::atomic<std::uint32_t> leases{0};
    std::atomic<bool> used{false};  // since trim() saw it last
    std::atomic<std::uint32_t> ghost_searches{0};
  };

 public:
  static constexpr std::size_t kLeastAhead = 64;

  // The store and the sieve must outlive this object.
  TileCache(const TileStore& store, const SegmentSieve& sieve, TileEngineKind engine, std::uint64_t budget_bytes)
      : store_(store),
        sieve_(sieve),
        engine_(engine),
        budget_bytes_(budget_bytes),
        pages_(store.tile_count() / kPageSlots + 1) {}
  ~TileCache() {
    for (const TileId tile : order_) delete slotOf(tile)->tile.load();
    for (const std::atomic<Page*>& page : pages_) delete page.load();
  }
  // Keeps at most so many bytes from now on. Any thread may call it.
  void setBudget(std::uint64_t budget_bytes) {
    budget_bytes_ = budget_bytes;
    const std::lock_guard lock(mutex_);
    while (ahead_bytes_ > budget_bytes / 2 && !ahead_.empty()) dropAhead(ahead_.begin());
    trim();
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
    const SearchTile& operator*() const { return *tile_; }

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
    std::unique_ptr<const SearchTile> read = takeAhead(tile);
    if (read == nullptr) read = std::make_unique<SearchTile>(load(tile));
    ++reads;
    const std::lock_guard lock(mutex_);
    Slot& slot = madeSlot(tile);
    if (slot.tile.load() == nullptr) {
      order_.push_back(tile);
      bytes_ += read->bytes;
      slot.used.store(false);
      slot.ghost_searches.store(0);
      slot.tile.store(read.release());
    }
    slot.leases.fetch_add(1);
    Lease lease(slot, slot.tile.load());
    trim();
    return lease;
  }

  // Reads those of the tiles that are not here, many at once, and waits for those that another thread reads. They count
  // as read when get() takes them, so that results do not depend on where the set is. Until then they take at most half
  // of the budget, or the space of kLeastAhead tiles: of a longer list, the first are read. Returns false if a read
  // failed; get() tries it again.
  bool readAhead(std::span<const TileId> tiles) {
    const std::size_t most = mostAhead();
    std::vector<TileId> mine, others;
    {
      const std::lock_guard lock(mutex_);
      std::unordered_set<TileId> wanted;
      for (const TileId tile : tiles) {
        if (isHere(tile) || wanted.size() == most || !wanted.insert(tile).second) continue;
        if (const auto at = ahead_places_.find(tile); at != ahead_places_.end())
          ahead_.splice(ahead_.end(), ahead_, at->second);
        else
          (under_way_.insert(tile).second ? mine : others).push_back(tile);
      }
    }
    bool all = true;
    {
      const UnderWay landing{*this, mine};
      std::sort(mine.begin(), mine.end());
      std::vector<FutureRead<SearchTile>> reads;
      for (const TileId tile : mine)
        reads.emplace_back(mine.size() > 1 ? &readThreads() : nullptr, [this, tile] { return load(tile); });
      for (FutureRead<SearchTile>& read : reads) {
        try {
          keepAhead(read.get());
        } catch (const Error&) {
          all = false;
        }
      }
    }
    std::unique_lock lock(mutex_);
    for (const TileId tile : others) arrived_.wait(lock, [&] { return !under_way_.contains(tile); });
    return all;
  }
  // The most tiles that are kept between readAhead() and get().
  std::size_t mostAhead() const {
    const std::uint64_t a_tile = 1 + store_.decodedBytes() / std::max<std::uint64_t>(store_.tile_count(), 1);
    return std::max<std::uint64_t>(kLeastAhead, budget_bytes_ / 2 / a_tile);
  }

  // After a search of the tile's ghosts: sometimes, those of them are settled that `isWanted(tile, segment)` knows.
  // They then are searched as other segments, or not at all. Attempts become rare, because each asks for all ghosts.
  template <class IsWanted>
  void settleGhosts(TileId id, const IsWanted& isWanted) {
    constexpr std::uint32_t kFirst = 4;
    const std::uint32_t searches = slotOf(id)->ghost_searches.fetch_add(1, std::memory_order_relaxed) + 1;
    if (searches < kFirst || !std::has_single_bit(searches)) return;
    const Lease here = find(id);
    if (!here || here->ghosts == nullptr) return;
    const Tile& tile = *here->tile;
    std::vector<bool> sure(tile.segment_count()), unsure(tile.segment_count());
    std::vector<std::uint32_t> segments;
    here->engine->collect(Everywhere(), segments);
    for (const std::uint32_t s : segments) sure[s] = true;
    segments.clear();
    here->ghosts->collect(Everywhere(), segments);
    std::size_t left = segments.size();
    for (const std::uint32_t s : segments) {
      const std::optional<bool> wanted = isWanted(tile, s);
      if (!wanted) unsure[s] = true;
      if (wanted) sure[s] = *wanted, --left;
    }
    if (left < segments.size())
      replace(id, here, searchTile(here->tile, someRuns(tile, sure), someRuns(tile, unsure), here->wanted));
  }

  // Leaves all ghosts out of tiles that are read from now on. Call it before any tile is read.
  void leaveGhostsOut() { with_ghosts_ = false; }

  // A tile that is here or was read ahead, which stays where it is; nullopt: neither.
  std::optional<SearchTile> peek(TileId tile) {
    if (const Lease here = find(tile)) return *here.tile_;
    const std::lock_guard lock(mutex_);
    const auto at = ahead_places_.find(tile);
    return at == ahead_places_.end() ? std::nullopt : std::optional(*at->second);
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
  static constexpr TileId kPageSlots = 256;
  using Page = std::array<Slot, kPageSlots>;

  // Tiles that readAhead() reads: until its destruction.
  struct UnderWay {
    TileCache& cache;
    const std::vector<TileId>& tiles;
    ~UnderWay() {
      const std::lock_guard lock(cache.mutex_);
      for (const TileId tile : tiles) cache.under_way_.erase(tile);
      cache.arrived_.notify_all();
    }
  };

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

  SearchTile load(TileId tile) const {
    if (sieve_.takesAll()) {
      SearchTile read{store_.loadToSearch(tile), nullptr, nullptr, nullptr, 0};
      read.engine = makeTileEngine(engine_, read.tile);
      read.bytes = read.tile->bytes() + read.engine->bytes();
      return read;
    }
    const bool looks = sieve_.ofTypes() && !sieve_.allTypesOf(store_.entry(tile));
    FutureRead<TileAppearance> look(looks && store_.isRemote() ? &readThreads() : nullptr,
                                    [this, tile] { return store_.loadAppearance(tile); });
    const std::shared_ptr<const Tile> read = store_.loadToSearch(tile);
    const TileAppearance types = looks ? look.get() : TileAppearance();
    SegmentSieve::Sifted sifted = sieve_.sift(*read, looks ? &types : nullptr, with_ghosts_);
    return searchTile(read, std::move(sifted.sure), std::move(sifted.unsure),
                      sieve_.ofTypes() ? std::make_shared<const std::vector<bool>>(std::move(sifted.wanted)) : nullptr);
  }

  SearchTile searchTile(std::shared_ptr<const Tile> tile, std::vector<SegmentRun>&& sure,
                        std::vector<SegmentRun>&& unsure, std::shared_ptr<const std::vector<bool>> wanted) const {
    SearchTile made{std::move(tile), nullptr, nullptr, std::move(wanted), 0};
    const bool has_unsure = !unsure.empty();
    made.engine = makeTileEngine(engine_, made.tile, std::move(sure));
    if (has_unsure) made.ghosts = makeTileEngine(engine_, made.tile, std::move(unsure));
    made.bytes = made.tile->bytes() + made.engine->bytes() + (has_unsure ? made.ghosts->bytes() : 0) +
                 made.tile->segment_count() / 8;
    return made;
  }

  // Replaces a tile that is still here.
  void replace(TileId id, const Lease& old, SearchTile&& made) {
    const std::lock_guard lock(mutex_);
    Slot& slot = *slotOf(id);
    if (slot.tile.load() != &*old) return;
    bytes_ += made.bytes;
    drop(slot, new SearchTile(std::move(made)));
    freeDropped();
  }

  void keepAhead(SearchTile&& read) {
    const TileId tile = read.tile->id();
    const std::lock_guard lock(mutex_);
    if (isHere(tile) || ahead_places_.contains(tile)) return;  // another thread was faster
    ahead_bytes_ += read.bytes;
    ahead_.push_back(std::move(read));
    ahead_places_[tile] = std::prev(ahead_.end());
    while (ahead_bytes_ > budget_bytes_ / 2 && ahead_.size() > kLeastAhead) dropAhead(ahead_.begin());
  }
  std::unique_ptr<const SearchTile> takeAhead(TileId tile) {
    const std::lock_guard lock(mutex_);
    const auto at = ahead_places_.find(tile);
    return at == ahead_places_.end() ? nullptr : dropAhead(at->second);
  }
  // The caller holds the mutex.
  std::unique_ptr<const SearchTile> dropAhead(std::list<SearchTile>::iterator at) {
    auto taken = std::make_unique<const SearchTile>(std::move(*at));
    ahead_places_.erase(taken->tile->id());
    ahead_.erase(at);
    ahead_bytes_ -= taken->bytes;
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
    freeDropped();
  }
  void freeDropped() {
    std::erase_if(dropped_, [](const auto& one) { return one.first->leases.load() == 0; });
  }
  void drop(Slot& slot, const SearchTile* next = nullptr) {
    dropped_.emplace_back(&slot, nullptr);
    dropped_.back().second.reset(slot.tile.exchange(next));
    bytes_ -= dropped_.back().second->bytes;
  }

  const TileStore& store_;
  const SegmentSieve& sieve_;
  const TileEngineKind engine_;
  bool with_ghosts_ = true;
  std::atomic<std::uint64_t> budget_bytes_;
  std::vector<std::atomic<Page*>> pages_;
  mutable std::mutex mutex_;
  std::deque<TileId> order_;                                                  // the oldest first
  std::vector<std::pair<Slot*, std::unique_ptr<const SearchTile>>> dropped_;  // perhaps still leased
  std::uint64_t bytes_ = 0;
  std::list<SearchTile> ahead_;  // read ahead and not used yet, the oldest first
  std::unordered_map<TileId, std::list<SearchTile>::iterator> ahead_places_;
  std::uint64_t ahead_bytes_ = 0;
  std::unordered_set<TileId> under_way_;  // by readAhead()
  std::condition_variable arrived_;       // some of them
};

}  // namespace filiform::internal
