// Nearest::inBox().
#include "index/errors.h"
#include "index/geometry/closest_point.h"
#include "index/geometry/partition.h"
#include "index/query/internal/searched_set.h"
#include "index/query/internal/tile_rounds.h"
#include "index/query/nearest.h"
#include "index/tile/box_region.h"

#include <algorithm>
#include <cmath>

namespace filiform {

namespace {

// A box on the grid, and the tiles that meet it.
struct AskedBox {
  GridBox box;
  BoxRegion region;
  Vector3d middle_W;
  std::vector<TileId> tiles{};
  std::vector<WorldBox> boxes{};  // of the tiles
  bool by_middle = false;         // only segments whose middle lies in the half-open box

  AskedBox(const Grid& grid, const Vector3d& lo_W, const Vector3d& hi_W)
      : box{snapped(grid, lo_W), snapped(grid, hi_W)},
        region({grid.toWorld(box.lo), grid.toWorld(box.hi)}),
        middle_W(0.5 * (region.box.lo_W + region.box.hi_W)) {}

  static GridPoint snapped(const Grid& grid, const Vector3d& p_W) {
    constexpr double kEdge = Grid::kMaxCoordinate_um;
    return grid.snap(p_W.cwiseMax(-kEdge).cwiseMin(kEdge));
  }
  void findTiles(const internal::SearchedSet& set, std::uint32_t& tiles_read) {
    auto found = set.tilesMeeting(region, tiles_read);
    std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    for (const auto& [tile, tile_box] : found) {
      tiles.push_back(tile);
      boxes.push_back(tile_box);
    }
  }
  bool holdsMiddle(const GridPoint& middle) const {
    return (middle.array() >= box.lo.array()).all() && (middle.array() < box.hi.array()).all();
  }
  // Whether a segment that tile `i` does not own is found in its owner too, or else in an earlier tile.
  bool isFoundElsewhere(const internal::SearchedSet& set, std::size_t i, const Tile& tile, std::uint32_t s,
                        std::uint32_t& tiles_read) const {
    const SegmentId id = tile.segmentId(s);
    const auto holds = [&](TileId other) {
      return set.cache.get(other, tiles_read)->tile->findSegment(id).has_value();
    };
    const auto isAsked = [&](TileId other) { return std::binary_search(tiles.begin(), tiles.end(), other); };
    const TileId far = set.store.long_tile();
    if (isAsked(set.store.home(internal::SearchedSet::middleOf(tile, s))) || (isAsked(far) && holds(far))) return true;
    const Vector3d child_W = tile.position_W(tile.child(s)), parent_W = tile.position_W(tile.parent(s));
    const Vector3d slack = Vector3d::Constant(1e-3) + 1e-9 * child_W.cwiseAbs();
    const Vector3d lo_W = child_W.cwiseMin(parent_W) - slack, hi_W = child_W.cwiseMax(parent_W) + slack;
    for (std::size_t j = 0; j < i; ++j)
      if (tiles[j] != far && (boxes[j].lo_W.array() <= hi_W.array()).all() &&
          (boxes[j].hi_W.array() >= lo_W.array()).all() && holds(tiles[j]))
        return true;
    return false;
  }
  // Adds the segments of tile `i` that meet the box: those that the filter may want to `ghosts`. `once`: no segment
  // that another tile adds too.
  void collect(const internal::SearchedSet& set, std::size_t i, bool once, std::uint32_t& tiles_read,
               std::vector<Candidate>& found, std::vector<internal::Unsure<Candidate>>& ghosts) const {
    set.forEachIn(region, tiles[i], tiles_read, [&](const Tile& tile, std::uint32_t s, bool is_sure) {
      const GridPoint child = tile.gridPoint(tile.child(s)), parent = tile.gridPoint(tile.parent(s));
      if (by_middle ? !holdsMiddle(midpoint(child, parent)) : !segmentMeetsBox(child, parent, box)) return;
      if (once && !tile.owned(s) && isFoundElsewhere(set, i, tile, s, tiles_read)) return;
      const ClosestPoint c = closestPoint(tile.position_W(tile.child(s)), tile.position_W(tile.parent(s)), middle_W);
      const Candidate candidate{c.squared_distance, tile.segmentId(s), c.t, c.p_W, tile.id()};
      if (is_sure)
        found.push_back(candidate);
      else
        ghosts.push_back({candidate, set.middleOf(tile, s)});
    });
  }
};

void checkBox(const Vector3d& lo_W, const Vector3d& hi_W) {
  if (!lo_W.allFinite() || !hi_W.allFinite() || (lo_W.array() > hi_W.array()).any())
    throw UsageError("a box needs six finite coordinates, in um: the lowest corner, then the highest");
}

// Adds the ghosts that the filter wants.
void settle(const internal::SearchedSet& set, const std::vector<internal::Unsure<Candidate>>& ghosts,
            std::uint32_t& tiles_read, std::vector<Candidate>& found) {
  set.readOwnersAhead(ghosts);
  for (const auto& ghost : ghosts)
    if (set.wants(ghost.found.segment, ghost.middle, tiles_read)) found.push_back(ghost.found);
}

// All segments of the box, some several times. Finds the tiles of `asked`.
std::vector<Candidate> foundIn(const internal::SearchedSet& set, AskedBox& asked, std::uint32_t& tiles_read) {
  std::vector<Candidate> found;
  std::vector<internal::Unsure<Candidate>> ghosts;
  asked.findTiles(set, tiles_read);
  internal::TileRounds rounds(set.store, set.cache, internal::TileRounds::kMost);
  for (std::uint32_t i = 0; i < asked.tiles.size(); ++i) {
    rounds.before(i, asked.tiles);
    asked.collect(set, i, false, tiles_read, found, ghosts);
  }
  settle(set, ghosts, tiles_read, found);
  return found;
}

NearestResult resultOf(const Candidate& c, std::size_t rank) {
  return {static_cast<std::uint32_t>(rank), std::sqrt(c.squared_distance), c.p_W, c.segment, c.t, c.tile, true};
}

// Calls visit(candidate) for each segment of the box from a place on, in the set's own order, and goesOn() before each
// tile but the first. Ends if one of them returns false. Returns where it ended; nullopt: the box has no more.
template <class Visit, class GoesOn>
std::optional<BoxPlace> walkBox(const internal::SearchedSet& set, AskedBox& asked, BoxPlace from, SearchCounts& counts,
                                const Visit& visit, const GoesOn& goesOn) {
  asked.findTiles(set, counts.tiles_read);
  internal::TileRounds rounds(set.store, set.cache, internal::TileRounds::kMost);
  std::vector<Candidate> found;
  std::vector<internal::Unsure<Candidate>> ghosts;
  for (std::uint32_t i = from.tile; i < asked.tiles.size(); ++i) {
    if (i > from.tile && !goesOn()) return BoxPlace{i, 0};
    rounds.before(i, asked.tiles);
    found.clear();
    ghosts.clear();
    asked.collect(set, i, true, counts.tiles_read, found, ghosts);
    settle(set, ghosts, counts.tiles_read, found);
    ++counts.tiles_searched;
    // Ghosts that were settled before come among the others.
    std::sort(found.begin(), found.end(), [](const Candidate& a, const Candidate& b) { return a.segment < b.segment; });
    for (std::size_t hit = i == from.tile ? from.hit : 0; hit < found.size(); ++hit)
      if (!visit(found[hit])) return BoxPlace{i, static_cast<std::uint32_t>(hit)};
  }
  return std::nullopt;
}

}  // namespace

std::vector<NearestResult> Nearest::inBox(const Vector3d& lo_W, const Vector3d& hi_W, bool of_cells) const {
  std::vector<NearestResult> results;
  inBox(lo_W, hi_W, of_cells, results);
  return results;
}

SearchCounts Nearest::inBox(const Vector3d& lo_W, const Vector3d& hi_W, bool of_cells,
                            std::vector<NearestResult>& results) const {
  checkBox(lo_W, hi_W);
  AskedBox asked(set_->store.grid(), lo_W, hi_W);
  SearchCounts counts;
  std::vector<Candidate> found = foundIn(*set_, asked, counts.tiles_read);
  std::sort(found.begin(), found.end());
  keepFirst(found, of_cells);
  results.clear();
  results.reserve(found.size());
  for (const Candidate& c : found) results.push_back(resultOf(c, results.size()));
  counts.tiles_searched = static_cast<std::uint32_t>(asked.tiles.size());
  return counts;
}

std::map<std::uint32_t, std::uint64_t> Nearest::countInBox(const Vector3d& lo_W, const Vector3d& hi_W,
                                                           bool by_middle) const {
  checkBox(lo_W, hi_W);
  AskedBox asked(set_->store.grid(), lo_W, hi_W);
  asked.by_middle = by_middle;
  std::uint32_t tiles_read = 0;
  std::vector<Candidate> found = foundIn(*set_, asked, tiles_read);
  const auto isLower = [](const Candidate& a, const Candidate& b) { return a.segment < b.segment; };
  std::sort(found.begin(), found.end(), isLower);
  std::map<std::uint32_t, std::uint64_t> counts;
  for (std::size_t i = 0; i < found.size(); ++i)
    if (i == 0 || isLower(found[i - 1], found[i])) ++counts[found[i].segment.cell];
  return counts;
}

BoxPart Nearest::partOfBox(const Vector3d& lo_W, const Vector3d& hi_W, BoxPlace from, std::size_t most,
                           const std::function<bool()>& ends) const {
  checkBox(lo_W, hi_W);
  AskedBox asked(set_->store.grid(), lo_W, hi_W);
  BoxPart part;
  part.next = walkBox(
      *set_, asked, from, part.counts,
      [&](const Candidate& c) {
        if (part.results.size() == most) return false;
        part.results.push_back(resultOf(c, part.results.size()));
        return true;
      },
      [&] { return part.results.size() < most && !(ends && ends()); });
  return part;
}

SearchCounts Nearest::forEachInBox(const Vector3d& lo_W, const Vector3d& hi_W,
                                   const std::function<bool(const NearestResult&)>& visit) const {
  checkBox(lo_W, hi_W);
  AskedBox asked(set_->store.grid(), lo_W, hi_W);
  SearchCounts counts;
  std::size_t rank = 0;
  walkBox(
      *set_, asked, {}, counts, [&](const Candidate& c) { return visit(resultOf(c, rank++)); }, [] { return true; });
  return counts;
}

}  // namespace filiform
