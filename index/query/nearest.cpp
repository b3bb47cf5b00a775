#include "index/query/nearest.h"

#include "index/errors.h"
#include "index/geometry/closest_point.h"
#include "index/geometry/partition.h"
#include "index/query/curve_order.h"
#include "index/query/internal/landmark_hint.h"
#include "index/query/tile_finder.h"
#include "index/tile/box_region.h"
#include "index/workers.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <deque>
#include <list>
#include <mutex>
#include <unordered_map>
#include <utility>

namespace filiform {
namespace {

constexpr std::size_t kLeastPerThread = 64;  // fewest points of a batch a thread
constexpr std::size_t kReadTogether = 4;     // tiles, from far away
constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct LoadedTile {
  std::shared_ptr<const Tile> tile;
  std::unique_ptr<const TileEngine> engine;
  std::uint64_t bytes;
};

// The most recently used tiles, within a byte budget. Thread rule: internally synchronised.
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

  // Reads without the lock: two threads may read the same tile, and one copy is kept.
  std::shared_ptr<const LoadedTile> get(TileId tile, std::uint32_t& reads) {
    if (auto found = find(tile)) return found;
    auto loaded = std::make_shared<LoadedTile>();
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
    std::shared_ptr<const LoadedTile> loaded;
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

// The boxes in which a hit may lie. A hit's closest approach lies in its segment's box, at most radius + slope * along
// from the ray. `along` is at most the box's farthest reach. So the ray meets the box enlarged by that distance.
struct RayRegion final : Region {
  Vector3d origin_W, direction;
  double radius_um, slope, length_um;

  RayRegion(const RayQuery& ray, const Vector3d& unit)
      : origin_W(ray.origin_W), direction(unit), radius_um(ray.radius_um), slope(ray.slope), length_um(ray.length_um) {}

  bool mayMeet(const WorldBox& box) const noexcept override { return entry(box) < kInfinity; }

  // The smallest distance along the ray at which a hit in the box may come, or infinity.
  double entry(const WorldBox& box) const noexcept {
    const Vector3d middle = 0.5 * (box.lo_W + box.hi_W) - origin_W, half = 0.5 * (box.hi_W - box.lo_W);
    const double centre = direction.dot(middle), reach = direction.cwiseAbs().dot(half);
    const double size = middle.cwiseAbs().maxCoeff() + half.maxCoeff() + origin_W.cwiseAbs().maxCoeff();
    const double rounding = 64 * std::numeric_limits<double>::epsilon() * size;
    const double last = centre + reach + rounding;
    const double grown = radius_um + slope * std::max(last, 0.0) + rounding;
    double from = 0, to = kInfinity;
    for (int axis = 0; axis < 3; ++axis) {
      const double lo = middle[axis] - half[axis] - grown, hi = middle[axis] + half[axis] + grown;
      if (direction[axis] == 0.0) {
        if (lo > 0 || hi < 0) return kInfinity;
        continue;
      }
      const double a = lo / direction[axis], b = hi / direction[axis];
      const double slack = 64 * std::numeric_limits<double>::epsilon() * std::max(std::abs(a), std::abs(b));
      from = std::max(from, std::min(a, b) - slack);
      to = std::min(to, std::max(a, b) + slack);
    }
    if (from > to) return kInfinity;
    // The closest approach lies in the box itself.
    const double first = std::max(0.0, centre - reach - rounding);
    return first <= length_um ? first : kInfinity;
  }
};

void checkQuery(const Vector3d& h_W, const NearestQuery& query) {
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
  const TileFinder finder;
  const LandmarkHint hint;
  mutable TileCache cache;

  Impl(const TileStore& s, const NearestOptions& options) : store(s), finder(s), hint(s), cache(s, options) {}

  struct Search {
    Vector3d h_W;
    Candidates best;
    std::uint32_t tiles_read = 0, tiles_searched = 0;
    double absent2 = kInfinity;  // squared distance within which no absent tile lies
  };

  // The tile finder does not contain the long-segment tile.
  std::vector<std::pair<TileId, WorldBox>> tilesMeeting(const Region& region) const {
    auto tiles = finder.meeting(region);
    if (store.long_tile() != kNoTile)
      tiles.emplace_back(store.long_tile(), WorldBox{Vector3d::Zero(), Vector3d::Zero()});
    return tiles;
  }

  // Calls visit(tile, segment) for the segments that the tile's engine cannot exclude.
  template <typename Region, typename Visit>
  void forEachIn(const Region& region, TileId id, std::uint32_t& tiles_read, const Visit& visit) const {
    const auto loaded = cache.get(id, tiles_read);
    std::vector<std::uint32_t> segments;
    loaded->engine->collect(region, segments);
    for (const std::uint32_t s : segments) visit(*loaded->tile, s);
  }

  void visit(Search& s, TileId tile) const {
    cache.get(tile, s.tiles_read)->engine->search(s.h_W, s.best);
    ++s.tiles_searched;
  }

  // The tile whose block contains the point, if its content does too. No tile can be nearer, so it must be searched in
  // any case. Its result bounds the rest without the landmarks.
  TileId homeOf(const Vector3d& h_W) const {
    if (!(h_W.cwiseAbs().maxCoeff() < Grid::kMaxCoordinate_um)) return kNoTile;
    const Grid grid = store.grid();
    const TileId home = store.home(grid.snap(h_W));
    if (home == kNoTile) return kNoTile;
    const GridBox& content = store.entry(home).content;
    const bool inside = (h_W.array() >= grid.toWorld(content.lo).array()).all() &&
                        (h_W.array() <= grid.toWorld(content.hi).array()).all();
    return inside ? home : kNoTile;
  }

  // True if the ball lies inside the tile's block: no other tile can then hold a result.
  bool answersAlone(TileId tile, const Vector3d& h_W, double squared_radius) const {
    const Grid grid = store.grid();
    const GridBox block = closedBlock(store.entry(tile).key);
    const Vector3d lo_W = grid.toWorld(block.lo), hi_W = grid.toWorld(block.hi);
    const double room = (h_W - lo_W).cwiseMin(hi_W - h_W).minCoeff();
    constexpr double kUlps = 16 * std::numeric_limits<double>::epsilon();
    const double size = std::max(lo_W.cwiseAbs().maxCoeff(), hi_W.cwiseAbs().maxCoeff());
    const double radius = std::sqrt(squared_radius);
    return room > radius + kUlps * (radius + size);
  }

  // The home and the tiles of its page of the directory that come next: from far away, a round of reads costs more than
  // a few tiles. Other pages are not read for this.
  std::vector<TileId> besideHome(TileId home, const Vector3d& h_W) const {
    const Grid grid = store.grid();
    const TileId first = home - home % store.page_tiles();
    std::vector<TileFinder::Hit> near;
    for (TileId t = first; t < std::min(store.tile_count(), first + store.page_tiles()); ++t) {
      const GridBox& content = store.entry(t).content;
      if (t == store.long_tile() || content.empty()) continue;
      const Vector3d off = (grid.toWorld(content.lo) - h_W).cwiseMax(h_W - grid.toWorld(content.hi)).cwiseMax(0.0);
      near.push_back({t, t == home ? -1 : off.squaredNorm()});
    }
    const std::size_t most = std::min(kReadTogether, near.size());
    std::partial_sort(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(most), near.end());
    std::vector<TileId> tiles;
    for (std::size_t i = 0; i < most; ++i) tiles.push_back(near[i].tile);
    return tiles;
  }

  void searchAll(Search& s) const {
    if (store.long_tile() != kNoTile) visit(s, store.long_tile());
    TileId home = kNoTile;
    if (store.tile_count() > TileFinder::kScanTiles && !finder.isOutside(s.h_W)) {
      home = homeOf(s.h_W);
      if (home != kNoTile) {
        if (store.isRemote() && cache.find(home) == nullptr) cache.readAhead(besideHome(home, s.h_W));
        visit(s, home);
        if (answersAlone(home, s.h_W, s.best.bound2())) return;
      }
    }
    TileFinder::Walk walk = finder.walk(s.h_W);
    while (const auto hit = walk.next(s.best.bound2()))
      if (hit->tile != home) visit(s, hit->tile);
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
    TileFinder::Walk walk = finder.walk(s.h_W);
    std::size_t left = resident.size() - (long_tile != kNoTile && s.absent2 > 0 ? 1 : 0);
    // After the last resident tile, one absent tile shows from which distance on results may be missing.
    while (const auto hit = walk.next(s.best.bound2())) {
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
  checkQuery(h_W, query);
  std::vector<NearestResult> results;
  if (query.k == 0) return results;

  if (query.approximate) {
    for (const LandmarkHint::Guess& g : impl_->hint.nearest(h_W, query.k)) {
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
    impl_->searchAll(search);

  for (const Candidate& c : search.best.sorted()) {
    const double distance = std::sqrt(c.squared_distance);
    if (distance > query.max_distance_um) break;
    const bool exact = query.epsilon == 0 && c.squared_distance < search.absent2;
    const auto rank = static_cast<std::uint32_t>(results.size());
    results.push_back({rank, distance, c.p_W, c.segment, c.t, c.tile, exact, search.tiles_read, search.tiles_searched});
  }
  return results;
}

void Nearest::forEach(std::span<const Vector3d> points, const NearestQuery& query, unsigned threads,
                      const std::function<void(std::size_t i, std::vector<NearestResult>&& results)>& visit) const {
  for (const Vector3d& h_W : points) checkQuery(h_W, query);
  const std::vector<std::size_t> order = curveOrder(impl_->store.grid(), points);

  // Consecutive parts of the curve, so that threads need different tiles.
  const std::size_t parts = std::clamp<std::size_t>(order.size() / kLeastPerThread, 1, std::max(threads, 1u));
  std::atomic<std::size_t> next{0};
  runWorkers(parts, [&](unsigned, const std::atomic<bool>& failed) {
    for (std::size_t part; !failed && (part = next.fetch_add(1)) < parts;) {
      const std::size_t begin = order.size() * part / parts, end = order.size() * (part + 1) / parts;
      for (std::size_t i = begin; i < end && !failed; ++i) visit(order[i], find(points[order[i]], query));
    }
  });
}

std::vector<std::vector<NearestResult>> Nearest::findAll(std::span<const Vector3d> points, const NearestQuery& query,
                                                         unsigned threads) const {
  std::vector<std::vector<NearestResult>> results(points.size());
  forEach(points, query, threads,
          [&](std::size_t i, std::vector<NearestResult>&& found) { results[i] = std::move(found); });
  return results;
}

std::vector<NearestResult> Nearest::inBox(const Vector3d& lo_W, const Vector3d& hi_W) const {
  if (!lo_W.allFinite() || !hi_W.allFinite() || (lo_W.array() > hi_W.array()).any())
    throw UsageError("a box needs six finite coordinates, in um: the lowest corner, then the highest");
  const Grid grid = impl_->store.grid();
  const auto snapped = [&](const Vector3d& p_W) {
    constexpr double kEdge = Grid::kMaxCoordinate_um;
    return grid.snap(p_W.cwiseMax(-kEdge).cwiseMin(kEdge));
  };
  const GridBox box{snapped(lo_W), snapped(hi_W)};
  const BoxRegion region({grid.toWorld(box.lo), grid.toWorld(box.hi)});
  const Vector3d middle_W = 0.5 * (region.box.lo_W + region.box.hi_W);

  std::vector<Candidate> found;
  std::uint32_t tiles_read = 0, tiles_searched = 0;
  for (const auto& [tile_id, tile_box] : impl_->tilesMeeting(region)) {
    ++tiles_searched;
    impl_->forEachIn(region, tile_id, tiles_read, [&](const Tile& tile, std::uint32_t s) {
      if (!segmentMeetsBox(tile.gridPoint(tile.child(s)), tile.gridPoint(tile.parent(s)), box)) return;
      const ClosestPoint c = closestPoint(tile.position_W(tile.child(s)), tile.position_W(tile.parent(s)), middle_W);
      found.push_back({c.squared_distance, tile.segmentId(s), c.t, c.p_W, tile.id()});
    });
  }
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end(),
                          [](const Candidate& a, const Candidate& b) { return a.segment == b.segment; }),
              found.end());
  std::vector<NearestResult> results;
  results.reserve(found.size());
  for (const Candidate& c : found)
    results.push_back({static_cast<std::uint32_t>(results.size()), std::sqrt(c.squared_distance), c.p_W, c.segment, c.t,
                       c.tile, true, tiles_read, tiles_searched});
  return results;
}

std::vector<RayHit> Nearest::alongRay(const RayQuery& ray) const {
  const double length = ray.direction.norm();
  if (!ray.origin_W.allFinite() || !(length > 0) || !std::isfinite(length))
    throw UsageError("a ray needs a finite origin and a finite direction that is not 0");
  if (ray.origin_W.cwiseAbs().maxCoeff() > kMaxCoordinate_um)
    throw UsageError("a ray's origin must lie within 1e150 um");
  if (!(ray.radius_um >= 0) || !(ray.slope >= 0) || !std::isfinite(ray.radius_um) || !std::isfinite(ray.slope) ||
      !(ray.length_um >= 0))
    throw UsageError("a ray's radius, slope and length must be 0 or more");
  const RayRegion region(ray, ray.direction / length);

  std::vector<std::pair<double, TileId>> order;  // by the distance along the ray of a first possible hit
  for (const auto& [tile, box] : impl_->tilesMeeting(region))
    order.emplace_back(tile == impl_->store.long_tile() ? 0.0 : region.entry(box), tile);
  std::sort(order.begin(), order.end());

  std::vector<RayHit> hits;
  const auto before = [](const RayHit& a, const RayHit& b) {
    return a.along_um != b.along_um ? a.along_um < b.along_um : a.segment < b.segment;
  };
  const auto settle = [&] {
    std::sort(hits.begin(), hits.end(), before);
    hits.erase(
        std::unique(hits.begin(), hits.end(), [](const RayHit& a, const RayHit& b) { return a.segment == b.segment; }),
        hits.end());
    if (hits.size() > ray.most) hits.erase(hits.begin() + static_cast<std::ptrdiff_t>(ray.most), hits.end());
  };
  std::uint32_t tiles_read = 0, tiles_searched = 0;
  for (const auto& [entry, tile_id] : order) {
    if (hits.size() == ray.most && (hits.empty() || entry > hits.back().along_um)) break;
    ++tiles_searched;
    impl_->forEachIn(region, tile_id, tiles_read, [&](const Tile& tile, std::uint32_t s) {
      const ClosestApproach c = closestApproach(tile.position_W(tile.child(s)), tile.position_W(tile.parent(s)),
                                                region.origin_W, region.direction);
      const double distance = std::sqrt(c.squared_distance);
      if (c.along <= ray.length_um && distance <= ray.radius_um + ray.slope * c.along)
        hits.push_back({c.along, distance, c.p_W, tile.segmentId(s), c.t, tile.id(), 0, 0});
    });
    settle();
  }
  for (RayHit& hit : hits) hit.tiles_read = tiles_read, hit.tiles_searched = tiles_searched;
  return hits;
}

double Nearest::covering_radius_um() const { return impl_->hint.covering_radius_um(); }

std::uint64_t Nearest::bytes() const { return impl_->cache.bytes(); }

}  // namespace filiform
