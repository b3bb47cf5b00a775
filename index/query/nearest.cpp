#include "index/query/nearest.h"

#include "index/errors.h"
#include "index/geometry/closest_point.h"
#include "index/geometry/partition.h"
#include "index/query/curve_order.h"
#include "index/query/internal/searched_set.h"
#include "index/query/internal/tile_rounds.h"
#include "index/query/internal/visit_in_rounds.h"
#include "index/set/reads_at_once.h"
#include "index/tile/box_region.h"
#include "index/workers.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <utility>

namespace filiform {
namespace {

constexpr std::size_t kLeastPerThread = 64;   // fewest points of a batch a thread
constexpr std::size_t kReadTogether = 4;      // tiles, from far away
constexpr std::size_t kBatchTogether = 1024;  // points of a batch whose tiles are read together, from far away
constexpr std::size_t kPointTogether = 64;    // most tiles that one such point asks for at a time
constexpr double kInfinity = std::numeric_limits<double>::infinity();

void checkQuery(const Vector3d& h_W, const NearestQuery& query) {
  if (!h_W.allFinite()) throw UsageError("a query point needs three finite coordinates, in um");
  if (h_W.cwiseAbs().maxCoeff() > Nearest::kMaxCoordinate_um)
    throw UsageError("a query point's coordinates must lie within 1e150 um");
  if (!(query.epsilon >= 0) || std::isinf(query.epsilon))
    throw UsageError("epsilon must be a finite number, 0 or more");
  if (!(query.max_distance_um >= 0)) throw UsageError("the largest distance must be 0 um or more");
}

// One search for the nearest segments to a point.
struct PointSearch {
  internal::SearchedSet& set;
  Vector3d h_W;
  Candidates best;
  SearchCounts counts;
  double absent2 = kInfinity;  // squared distance within which nothing absent lies
  bool all = false;            // everything within the bound is wanted
  const TileFinder& finder;
  std::vector<internal::Unsure<Candidate>> ghosts{};  // within the bound when they were found

  PointSearch(internal::SearchedSet& s, const Vector3d& from_W, const NearestQuery& query,
              std::uint32_t without = Candidates::kNoCell)
      : set(s),
        h_W(from_W),
        best(query.k, query.epsilon, std::nextafter(query.max_distance_um * query.max_distance_um, kInfinity),
             query.of_cells, without),
        all(query.k == SIZE_MAX),
        finder(s.finder(counts.tiles_read)) {}
  void run(bool resident_only) { resident_only ? searchResident() : searchAll(); }
  void searchAll();
  void searchResident();
  // Searches the tiles in memory. Returns the first tiles that the search needs beside these, at most about `most`.
  std::vector<TileId> foresee(std::size_t most);

  void search(const internal::SearchTile& tile);
  void visit(TileId tile);
  void searchTiles();
  void searchFarAway(TileId at_home);
  // Offers the ghosts that wants(candidate, middle) takes, nearest first, while they can be among the best.
  template <class Wants>
  void offerGhosts(const Wants& wants);
  // The tile whose block contains the point, if its content does too. No tile can be nearer, so it must be searched in
  // any case. Its result bounds the rest without the landmarks.
  TileId home() const;
  // True if the ball lies inside the tile's block: no other tile can then hold a result.
  bool answersAlone(TileId tile, double squared_radius) const;
  // The home and the tiles of its page of the directory that come next: from far away, a round of reads costs more than
  // a few tiles. Other pages are not read for this.
  std::vector<TileId> besideHome(TileId home) const;
};

void PointSearch::search(const internal::SearchTile& tile) {
  tile.engine->search(h_W, best);
  if (tile.ghosts == nullptr) return;
  Candidates within(SIZE_MAX, 0, best.bound2());
  tile.ghosts->search(h_W, within);
  for (const Candidate& c : within.sorted())
    ghosts.push_back({c, internal::SearchedSet::middleOf(*tile.tile, *tile.tile->findSegment(c.segment))});
}

void PointSearch::visit(TileId tile) {
  bool has_ghosts = false;
  {
    const internal::TileCache::Lease loaded = set.cache.get(tile, counts.tiles_read);
    search(*loaded);
    has_ghosts = loaded->ghosts != nullptr;
  }
  ++counts.tiles_searched;
  if (has_ghosts) set.settleGhosts(tile);
}

template <class Wants>
void PointSearch::offerGhosts(const Wants& wants) {
  std::sort(ghosts.begin(), ghosts.end());
  for (const auto& ghost : ghosts) {
    if (ghost.found.squared_distance > best.bound2()) return;
    if (wants(ghost.found, ghost.middle)) best.offer(ghost.found);
  }
}

TileId PointSearch::home() const {
  if (!(h_W.cwiseAbs().maxCoeff() < Grid::kMaxCoordinate_um)) return kNoTile;
  const Grid grid = set.store.grid();
  const TileId tile = set.store.home(grid.snap(h_W));
  if (tile == kNoTile || !set.mayHold(tile)) return kNoTile;
  const GridBox& content = set.store.entry(tile).content;
  const bool inside = (h_W.array() >= grid.toWorld(content.lo).array()).all() &&
                      (h_W.array() <= grid.toWorld(content.hi).array()).all();
  return inside ? tile : kNoTile;
}

bool PointSearch::answersAlone(TileId tile, double squared_radius) const {
  const Grid grid = set.store.grid();
  const GridBox block = closedBlock(set.store.entry(tile).key);
  const Vector3d lo_W = grid.toWorld(block.lo), hi_W = grid.toWorld(block.hi);
  const double room = (h_W - lo_W).cwiseMin(hi_W - h_W).minCoeff();
  constexpr double kUlps = 16 * std::numeric_limits<double>::epsilon();
  const double size = std::max(lo_W.cwiseAbs().maxCoeff(), hi_W.cwiseAbs().maxCoeff());
  const double radius = std::sqrt(squared_radius);
  return room > radius + kUlps * (radius + size);
}

std::vector<TileId> PointSearch::besideHome(TileId home) const {
  const Grid grid = set.store.grid();
  const TileId first = home - home % set.store.page_tiles();
  std::vector<TileFinder::Hit> near;
  for (TileId t = first; t < std::min(set.store.tile_count(), first + set.store.page_tiles()); ++t) {
    const GridBox& content = set.store.entry(t).content;
    if (t == set.store.long_tile() || content.empty() || !set.mayHold(t)) continue;
    const Vector3d off = (grid.toWorld(content.lo) - h_W).cwiseMax(h_W - grid.toWorld(content.hi)).cwiseMax(0.0);
    near.push_back({t, t == home ? -1 : off.squaredNorm()});
  }
  const std::size_t most = std::min(kReadTogether, near.size());
  std::partial_sort(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(most), near.end());
  std::vector<TileId> tiles;
  for (std::size_t i = 0; i < most; ++i) tiles.push_back(near[i].tile);
  return tiles;
}

void PointSearch::searchAll() {
  searchTiles();
  std::erase_if(ghosts, [this](const auto& ghost) { return ghost.found.squared_distance > best.bound2(); });
  set.readOwnersAhead(ghosts);
  offerGhosts(
      [this](const Candidate& c, const GridPoint& middle) { return set.wants(c.segment, middle, counts.tiles_read); });
}

void PointSearch::searchTiles() {
  const bool is_far = set.store.isRemote();
  const TileId long_tile = set.long_tile();
  const bool has_home = !set.isOfCells() && set.store.tile_count() > TileFinder::kScanTiles && !finder.isOutside(h_W);
  const TileId at_home = has_home ? home() : kNoTile;
  if (is_far && at_home != kNoTile && !set.cache.peek(at_home)) {
    std::vector<TileId> tiles = besideHome(at_home);
    if (long_tile != kNoTile) tiles.push_back(long_tile);
    set.cache.readAhead(tiles);
  }
  if (long_tile != kNoTile) visit(long_tile);
  if (at_home != kNoTile) {
    visit(at_home);
    if (answersAlone(at_home, best.bound2())) return;
  }
  if (is_far) return searchFarAway(at_home);
  TileFinder::Walk walk = finder.walk(h_W);
  while (const auto hit = walk.next(best.bound2()))
    if (hit->tile != at_home && set.mayHold(hit->tile)) visit(hit->tile);
}

// Visits the tiles that searchAll() visits nearby, and reads them in rounds. If everything within the bound is wanted,
// the first round is long.
void PointSearch::searchFarAway(TileId at_home) {
  if (all && std::isfinite(best.bound2())) {
    const Vector3d reach_W = Vector3d::Constant(std::nextafter(std::sqrt(best.bound2()), kInfinity));
    finder.readPages(BoxRegion({h_W - reach_W, h_W + reach_W}));
  }
  TileFinder::Walk walk = finder.walk(h_W);
  internal::TileRounds rounds(set.store, set.cache, all ? internal::TileRounds::kMost : 2);
  std::vector<double> squared;  // distances of `tiles`
  std::vector<TileId> tiles;
  for (std::size_t at = 0;; ++at) {
    if (at == tiles.size()) {
      for (const std::size_t end = at + rounds.length(); tiles.size() < end;) {
        const auto hit = walk.next(best.bound2());
        if (!hit) break;
        if (hit->tile == at_home || !set.mayHold(hit->tile)) continue;
        tiles.push_back(hit->tile);
        squared.push_back(hit->squared_distance);
      }
      if (at == tiles.size()) return;
    }
    if (squared[at] > best.bound2()) return;
    rounds.before(at, tiles);
    visit(tiles[at]);
  }
}

std::vector<TileId> PointSearch::foresee(std::size_t most) {
  std::vector<TileId> absent;
  const auto searched = [&](TileId tile) {
    const auto known = set.cache.peek(tile);
    known ? search(*known) : absent.push_back(tile);
    return known.has_value();
  };
  if (set.store.long_tile() != kNoTile) searched(set.store.long_tile());
  const TileId at_home = home();
  if (at_home != kNoTile && !searched(at_home)) return absent;
  if (at_home == kNoTile || !answersAlone(at_home, best.bound2())) {
    TileFinder::Walk walk = finder.walk(h_W);
    while (absent.size() < most) {
      const auto hit = walk.next(best.bound2());
      if (!hit) break;
      if (hit->tile != at_home && set.mayHold(hit->tile)) searched(hit->tile);
    }
  }
  if (!absent.empty()) return absent;
  offerGhosts([&](const Candidate& c, const GridPoint& middle) {
    const TileId owner = set.ownerOf(middle);
    const auto known = owner != kNoTile ? set.cache.peek(owner) : std::nullopt;
    if (owner != kNoTile && !known) absent.push_back(owner);
    return known && internal::SearchedSet::wants(*known, c.segment);
  });
  return absent;
}

void PointSearch::searchResident() {
  const std::vector<TileId> resident = set.cache.resident();
  const auto visit_resident = [&](TileId tile) {
    if (!std::binary_search(resident.begin(), resident.end(), tile)) return false;
    const internal::TileCache::Lease loaded = set.cache.find(tile);
    if (!loaded) return false;
    search(*loaded);
    ++counts.tiles_searched;
    return true;
  };
  const TileId long_tile = set.long_tile();
  if (long_tile != kNoTile && !visit_resident(long_tile)) absent2 = 0;
  TileFinder::Walk walk = finder.walk(h_W);
  std::size_t left = resident.size() - (long_tile != kNoTile && absent2 > 0 ? 1 : 0);
  // After the last resident tile, one absent tile shows from which distance on results may be missing.
  while (const auto hit = walk.next(best.bound2())) {
    if (left == 0 && std::isfinite(absent2)) break;
    if (!set.mayHold(hit->tile)) continue;
    if (visit_resident(hit->tile))
      --left;
    else
      absent2 = std::min(absent2, hit->squared_distance);
  }
  offerGhosts([this](const Candidate& c, const GridPoint& middle) {
    const TileId owner = set.ownerOf(middle);
    const internal::TileCache::Lease known = owner != kNoTile ? set.cache.find(owner) : internal::TileCache::Lease();
    if (owner != kNoTile && !known) absent2 = std::min(absent2, c.squared_distance);
    return known && internal::SearchedSet::wants(*known, c.segment);
  });
}

// Reads what the searches of the first of these points will need, many tiles at once, and returns the number of these
// points. A point asks for the next tiles that its search needs, then for twice as many; other points do not wait for
// it. Decides nothing: the searches read what is missing, and report what cannot be read.
std::size_t readBatchAhead(internal::SearchedSet& set, std::span<const Vector3d> points,
                           std::span<const std::size_t> order, const NearestQuery& query) {
  order = order.first(std::min(order.size(), kBatchTogether));
  const std::size_t most_tiles = set.cache.mostAhead();
  std::atomic<std::size_t> tiles{0}, end{order.size()};
  try {
    runItems(order.size(), mostReadThreads(), [&](std::size_t i) {
      for (std::size_t most = 2; most <= kPointTogether; most *= 2) {
        if (i >= end) return;
        const std::vector<TileId> absent = PointSearch(set, points[order[i]], query).foresee(most);
        if (absent.empty()) return;
        if ((tiles += absent.size()) <= most_tiles && set.cache.readAhead(absent)) continue;
        for (std::size_t before = end; i < before && !end.compare_exchange_weak(before, i);) continue;
      }
    });
  } catch (const Error&) {
  }
  return std::max<std::size_t>(end, 1);
}

}  // namespace

Nearest::Nearest(const TileStore& store, const NearestOptions& options) {
  set_ = std::make_unique<internal::SearchedSet>(store, options.filter, options.engine, options.budget_bytes);
  if (!options.filter.takesAll())
    all_ = std::make_unique<internal::SearchedSet>(store, SegmentFilter(), options.engine, options.budget_bytes / 2);
}
Nearest::~Nearest() = default;

std::vector<NearestResult> Nearest::find(const Vector3d& h_W, const NearestQuery& query) const {
  std::vector<NearestResult> results;
  find(h_W, query, results);
  return results;
}

SearchCounts Nearest::find(const Vector3d& h_W, const NearestQuery& query, std::vector<NearestResult>& results) const {
  checkQuery(h_W, query);
  results.clear();
  SearchCounts counts;
  if (query.k == 0) return counts;
  if (query.approximate && (!set_->sieve.takesAll() || query.of_cells || query.other_cells))
    throw UsageError("an approximate search takes no filter and finds no cells");

  if (query.approximate) {
    for (const LandmarkHint::Guess& g : set_->hint.nearest(h_W, query.k)) {
      if (g.distance > query.max_distance_um) break;
      const auto rank = static_cast<std::uint32_t>(results.size());
      results.push_back({rank, g.distance, g.p_W, g.segment, g.t, kNoTile, false});
    }
    return counts;
  }

  if (query.resident_only && !set_->isPlanned()) return counts;
  std::uint32_t own = Candidates::kNoCell;
  bool knows_own = true;
  if (query.other_cells) {
    PointSearch nearest(all_ ? *all_ : *set_, h_W, {});
    nearest.run(query.resident_only);
    const std::span<const Candidate> found = nearest.best.sorted();
    if (!found.empty()) own = found[0].segment.cell;
    knows_own = found.empty() ? std::isinf(nearest.absent2) : found[0].squared_distance < nearest.absent2;
    counts = nearest.counts;
    if (!all_) counts.tiles_searched = 0;  // the second search takes these tiles too
  }
  PointSearch search(*set_, h_W, query, own);
  search.run(query.resident_only);
  counts += search.counts;

  for (const Candidate& c : search.best.sorted()) {
    const double distance = std::sqrt(c.squared_distance);
    if (distance > query.max_distance_um) break;
    const bool exact = knows_own && query.epsilon == 0 && c.squared_distance < search.absent2;
    const auto rank = static_cast<std::uint32_t>(results.size());
    results.push_back({rank, distance, c.p_W, c.segment, c.t, c.tile, exact});
  }
  return counts;
}

SearchCounts Nearest::forEachNearest(const Vector3d& h_W, const NearestQuery& query,
                                     const std::function<bool(const NearestResult&)>& visit) const {
  if (query.epsilon != 0 || query.resident_only)
    throw UsageError("segments in order of distance need an exact search: without epsilon and resident_only");
  NearestQuery some = query;
  return internal::visitInRounds<NearestResult>(
      some.k, [&](std::vector<NearestResult>& results) { return find(h_W, some, results); }, visit);
}

void Nearest::forEach(std::span<const Vector3d> points, const NearestQuery& query, unsigned threads,
                      const std::function<void(std::size_t i, std::vector<NearestResult>&& results,
                                               const SearchCounts& counts)>& visit) const {
  for (const Vector3d& h_W : points) checkQuery(h_W, query);
  const std::vector<std::size_t> order = curveOrder(set_->store.grid(), points);

  const bool reads_ahead = set_->store.isRemote() && set_->store.tile_count() > TileFinder::kScanTiles &&
                           points.size() > 1 && query.k > 0 && !query.approximate && !query.resident_only;

  // Consecutive parts of the curve, so that threads need different tiles.
  const std::size_t parts = std::clamp<std::size_t>(order.size() / kLeastPerThread, 1, std::max(threads, 1u));
  std::atomic<std::size_t> next{0};
  runWorkers(parts, [&](unsigned, const std::atomic<bool>& failed) {
    for (std::size_t part; !failed && (part = next.fetch_add(1)) < parts;) {
      const std::size_t begin = order.size() * part / parts, end = order.size() * (part + 1) / parts;
      for (std::size_t i = begin, next_ahead = begin; i < end && !failed; ++i) {
        if (reads_ahead && i == next_ahead)
          next_ahead += set_->isPlanned() && !set_->isOfCells()
                            ? readBatchAhead(*set_, points, std::span(order).subspan(i, end - i), query)
                            : 1;
        std::vector<NearestResult> found;
        const SearchCounts counts = find(points[order[i]], query, found);
        visit(order[i], std::move(found), counts);
      }
    }
  });
}

std::vector<std::vector<NearestResult>> Nearest::findAll(std::span<const Vector3d> points, const NearestQuery& query,
                                                         unsigned threads) const {
  std::vector<std::vector<NearestResult>> results(points.size());
  forEach(points, query, threads, [&](std::size_t i, std::vector<NearestResult>&& found, const SearchCounts&) {
    results[i] = std::move(found);
  });
  return results;
}

double Nearest::covering_radius_um() const { return set_->hint.covering_radius_um(); }

const TileStore& Nearest::tiles() const { return set_->cached; }

void Nearest::setBudget(std::uint64_t budget_bytes) const {
  set_->cache.setBudget(budget_bytes);
  if (all_) all_->cache.setBudget(budget_bytes / 2);
}

std::uint64_t Nearest::bytes() const { return set_->cache.bytes() + (all_ ? all_->cache.bytes() : 0); }

}  // namespace filiform
