#include "index/nearest.h"

#include "index/directory.h"
#include "index/errors.h"
#include "index/sample_hint.h"
#include "index/tile_engine.h"

#include <algorithm>
#include <cmath>
#include <list>
#include <mutex>
#include <unordered_map>
#include <utility>

namespace filiform {
namespace {

constexpr TileId kScanTiles = 64;  // up to here neither FLANN nor a directory pays
constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct LoadedTile {
  std::unique_ptr<const TileEngine> engine;  // keeps the tile alive
  std::uint64_t bytes;
};

// The tiles last used, under a byte budget. Thread rule: internally
// synchronised.
class TileCache {
 public:
  TileCache(const TileStore& store, const NearestOptions& options) : store_(store), options_(options) {}

  std::shared_ptr<const LoadedTile> find(TileId tile) {
    const std::lock_guard lock(mutex_);
    const auto at = tiles_.find(tile);
    if (at == tiles_.end()) return nullptr;
    order_.splice(order_.begin(), order_, at->second.place);
    return at->second.loaded;
  }

  // Reads outside the lock: two threads may read the same tile, and one copy
  // stays.
  std::shared_ptr<const LoadedTile> get(TileId tile, std::uint32_t& reads) {
    if (auto found = find(tile)) return found;
    std::shared_ptr<const Tile> read = store_.load(tile);
    ++reads;
    const std::uint64_t tile_bytes = read->bytes();
    auto loaded = std::make_shared<LoadedTile>();
    loaded->engine = makeTileEngine(options_.engine, std::move(read));
    loaded->bytes = tile_bytes + loaded->engine->bytes();
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
    std::shared_ptr<const LoadedTile> loaded;
    std::list<TileId>::iterator place;
  };

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
  std::list<TileId> order_;  // last used first
  std::unordered_map<TileId, Slot> tiles_;
  std::uint64_t bytes_ = 0;
};

void check(const Vector3d& h_W, const NearestQuery& query) {
  if (!h_W.allFinite()) throw UsageError("a query point needs three finite coordinates, in um");
  if (h_W.cwiseAbs().maxCoeff() > Nearest::kMaxCoordinate_um)
    throw UsageError("a query point's coordinates must lie within 1e150 um");
  if (!(query.epsilon >= 0) || std::isinf(query.epsilon))
    throw UsageError("epsilon must be a finite number, 0 or more");
  if (!(query.max_distance_um >= 0)) throw UsageError("the largest distance must be 0 um or more");
}

}  // namespace

struct Nearest::Impl {
  const TileStore& store;
  const Directory directory;
  const SampleHint hint;
  mutable TileCache cache;

  Impl(const TileStore& s, const NearestOptions& options) : store(s), directory(s), hint(s), cache(s, options) {}

  struct Search {
    Vector3d h_W;
    Candidates best;
    std::uint32_t tiles_read = 0, tiles_searched = 0;
    double absent2 = kInfinity;  // squared distance below which nothing absent can lie
  };

  void visit(Search& s, TileId tile) const {
    cache.get(tile, s.tiles_read)->engine->search(s.h_W, s.best);
    ++s.tiles_searched;
  }

  void searchAll(Search& s, std::size_t k) const {
    if (store.long_tile() != kNoTile) visit(s, store.long_tile());
    const bool inside = store.tile_count() <= kScanTiles || !directory.isOutside(s.h_W);
    if (store.tile_count() > kScanTiles && inside) s.best.promise(hint.squaredBound(s.h_W, k));
    if (inside && (store.tile_count() <= kScanTiles || std::isfinite(s.best.bound2()))) {
      for (const Directory::Hit& hit : directory.within(s.h_W, s.best.bound2())) {
        if (hit.squared_distance > s.best.bound2()) break;
        visit(s, hit.tile);
      }
    } else {
      Directory::Walk walk = directory.walk(s.h_W);
      for (auto hit = walk.next(); hit && hit->squared_distance <= s.best.bound2(); hit = walk.next())
        visit(s, hit->tile);
    }
  }

  void searchResident(Search& s) const {
    const std::vector<TileId> resident = cache.resident();
    const auto visit_resident = [&](TileId tile) {
      const std::shared_ptr<const LoadedTile> loaded =
          std::binary_search(resident.begin(), resident.end(), tile) ? cache.find(tile) : nullptr;
      if (loaded == nullptr) return false;
      loaded->engine->search(s.h_W, s.best);
      ++s.tiles_searched;
      return true;
    };
    const TileId long_tile = store.long_tile();
    if (long_tile != kNoTile && !visit_resident(long_tile)) s.absent2 = 0;
    Directory::Walk walk = directory.walk(s.h_W);
    std::size_t left = resident.size() - (long_tile != kNoTile && s.absent2 > 0 ? 1 : 0);
    // Past the last resident tile, one absent tile tells from where on results may be missing.
    for (auto hit = walk.next(); hit && hit->squared_distance <= s.best.bound2(); hit = walk.next()) {
      if (left == 0 && std::isfinite(s.absent2)) break;
      if (visit_resident(hit->tile))
        --left;
      else
        s.absent2 = std::min(s.absent2, hit->squared_distance);
    }
  }
};

Nearest::Nearest(const TileStore& store, const NearestOptions& options) {
  requireTileEngine(options.engine);
  impl_ = std::make_unique<Impl>(store, options);
}
Nearest::~Nearest() = default;

std::vector<NearestResult> Nearest::find(const Vector3d& h_W, const NearestQuery& query) const {
  check(h_W, query);
  std::vector<NearestResult> results;
  if (query.k == 0) return results;

  if (query.approximate) {
    for (const SampleHint::Guess& g : impl_->hint.nearest(h_W, query.k)) {
      if (g.distance > query.max_distance_um) break;
      const auto rank = static_cast<std::uint32_t>(results.size());
      results.push_back({rank, g.distance, g.p_W, g.segment, g.t, kNoTile, false, 0, 0});
    }
    return results;
  }

  const double limit2 = std::nextafter(query.max_distance_um * query.max_distance_um, kInfinity);
  Impl::Search search{h_W, Candidates(query.k, query.epsilon, limit2)};
  if (query.resident_only)
    impl_->searchResident(search);
  else
    impl_->searchAll(search, query.k);

  for (const Candidate& c : search.best.sorted()) {
    const double distance = std::sqrt(c.squared_distance);
    if (distance > query.max_distance_um) break;
    const bool exact = query.epsilon == 0 && c.squared_distance < search.absent2;
    const auto rank = static_cast<std::uint32_t>(results.size());
    results.push_back({rank, distance, c.p_W, c.segment, c.t, c.tile, exact, search.tiles_read, search.tiles_searched});
  }
  return results;
}

double Nearest::covering_radius_um() const { return impl_->hint.covering_radius_um(); }

std::uint64_t Nearest::bytes() const { return impl_->cache.bytes(); }

}  // namespace filiform
