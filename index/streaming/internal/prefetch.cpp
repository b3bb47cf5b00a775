#include "index/streaming/internal/prefetch.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <unordered_map>
#include <unordered_set>

namespace filiform {
namespace {

constexpr double kMinReach_um = 1.0;
// Factors by which the time to reach a tile grows: back along the neurite, and by the angle of the turn at a branching.
constexpr double kBack = 2.0, kTurn = 1.5, kMost = 4.0;
// Tiles beyond the ends of the walk lie so many times farther behind than straight ahead, besides the factors above.
// Without a heading, all lie halfway: twice as far.
constexpr double kAsideFactor = 3;
constexpr std::size_t kMaxEnds = 64;
// Reach gained for each um between the hand and the proxy, up to twice the usual reach. A hand that waits beside a
// branch soon has the patience to climb far (bounded climb: half the workspace, and down again on the other side).
constexpr double kPull = 20;
// From far away, a tile beyond the reach comes late. Part of the usual reach that is gained for each s of look-ahead
// beyond the usual one.
constexpr double kPatience = 2;
// On a neurite, the proxy reaches its surroundings only along the neurite, which claimAhead() covers. In 1.9e8
// segments, a tour met no absent tile with an eighth of the workspace's radius or with all of it. An eighth needs an
// eighth of the tile reads. Where reads are fast, still less suffices, and in dense tissue these are most reads.
constexpr double kAroundOnStructure = 1.0 / 8;
// Pages of the directory are asked for before their tiles: those that may be needed within this many look-ahead times.
constexpr double kPagesAhead = 2;

// A node from which the walk continues, seen in `tile`, which may not be its home.
struct Step {
  double cost_s, arc_um, weight;
  NodeId node;
  const Tile* tile;
  std::uint32_t index;
  Vector3d way_W;  // unit vector of the last segment; zero at the start

  bool operator<(const Step& other) const {  // order of a max-heap: "comes later"
    return cost_s != other.cost_s ? cost_s > other.cost_s : node > other.node;
  }
};

// To the nearest point of the box.
Vector3d wayTo(const WorldBox& box, const Vector3d& p_W) { return p_W.cwiseMax(box.lo_W).cwiseMin(box.hi_W) - p_W; }

struct End {  // of the walk: the neurite continues from here, not in memory
  double cost_s, arc_um, weight;
  Vector3d p_W;
};

}  // namespace

Prefetch::Prefetch(const internal::KnownPages& store, const TileFinder& finder, PrefetchPolicy policy,
                   double lookahead_s)
    : store_(store), finder_(finder), policy_(policy) {
  setLookahead(lookahead_s);
  usual_lookahead_s_ = lookahead_s_;
}

double Prefetch::distance_um(TileId tile, const Vector3d& p_W) const { return wayTo(boxOf(tile), p_W).norm(); }

WorldBox Prefetch::boxOf(TileId tile) const {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const std::optional<GridBox> page = store_.boxOfUnknown(tile);
  const TileEntry* const entry = page ? nullptr : store_.find(tile);
  if (!page && entry == nullptr) return {Vector3d::Constant(-kInfinity), Vector3d::Constant(kInfinity)};
  const GridBox& box = page ? *page : entry->content;
  if (box.empty()) return {Vector3d::Constant(kInfinity), Vector3d::Constant(kInfinity)};
  const Grid grid = store_.grid();
  return {grid.toWorld(box.lo), grid.toWorld(box.hi)};
}

void Prefetch::claimAhead(const ReaderFocus& focus, const TileTable& loaded, std::span<const TileId> cell_tiles,
                          std::uint64_t budget_bytes, std::vector<TileClaim>& claims) const {
  if (policy_ != PrefetchPolicy::structure || focus.is_view || !focus.p_W.allFinite() ||
      !std::isfinite(focus.radius_um))
    return;
  const Tile* tile = loaded.find(focus.active_tile);
  std::optional<std::uint32_t> start;
  if (tile != nullptr) start = tile->findNode(focus.active_node);

  const Vector3d v_W = focus.v_W.allFinite() ? focus.v_W : Vector3d(Vector3d::Zero());
  const Vector3d pull_W = focus.pull_W.allFinite() ? focus.pull_W : Vector3d(Vector3d::Zero());
  const double speed = v_W.norm(), pull_um = pull_W.norm();
  // Where the proxy will be. At the end of what is in memory it stands still, and only the pull has a direction.
  const Vector3d heading = (v_W * lookahead_s_ + pull_W).stableNormalized();
  // At rest or slow motion, the proxy may start in any direction: walk at least the workspace's radius, or the part of
  // it for which there is time where reads are fast.
  const double rest_um = timePart() * focus.radius_um;
  const double usual_um = std::max({speed * lookahead_s_, rest_um, kMinReach_um});
  const double pace_um_s = usual_um / lookahead_s_;
  // The farther the hand is from the proxy, the farther along the neurite the solver looks and the proxy may leap.
  const double patience = std::clamp(kPatience * (lookahead_s_ - usual_lookahead_s_), 0.0, 1.0);
  const double reach_um = usual_um + std::clamp(kPull * pull_um, patience * usual_um, 2 * usual_um);

  std::unordered_map<TileId, double> cost;
  std::vector<End> ends;
  const auto enter = [&](TileId id, double cost_s) {
    const auto [at, first] = cost.try_emplace(id, cost_s);
    if (!first) at->second = std::min(at->second, cost_s);
  };
  if (start) {
    std::unordered_set<std::uint64_t> seen;
    std::priority_queue<Step> queue;
    queue.push({(tile->position_W(*start) - focus.p_W).norm() / pace_um_s, 0.0, 1.0, focus.active_node, tile, *start,
                Vector3d::Zero()});
    std::size_t budget = kMaxWalkedSegments;
    std::uint64_t bytes = 0;
    while (!queue.empty()) {
      Step at = queue.top();
      queue.pop();
      if (!seen.insert(at.node.key()).second) continue;
      const Vector3d from_W = at.tile->position_W(at.index);
      if (!at.tile->isHome(at.index)) {
        store_.setCost(at.cost_s);
        const std::optional<TileId> home = store_.findHome(at.tile->gridPoint(at.index));
        if (home == kNoTile) continue;
        const TileEntry* const entry = home ? store_.find(*home) : nullptr;
        if (entry != nullptr) {
          if (!cost.contains(*home)) bytes += entry->decoded_bytes;
          enter(*home, at.cost_s);
        }
        at.tile = home ? loaded.find(*home) : nullptr;
        if (at.tile == nullptr) {
          ends.push_back({at.cost_s, at.arc_um, at.weight, from_W});
          continue;
        }
        const std::optional<std::uint32_t> index = at.tile->findNode(at.node);
        if (!index) continue;
        at.index = *index;
      } else {
        if (!cost.contains(at.tile->id())) bytes += store_.entry(at.tile->id()).decoded_bytes;
        enter(at.tile->id(), at.cost_s);
      }
      // The first node's neighbours are always claimed.
      if (budget == 0 || bytes > budget_bytes || (at.arc_um > reach_um && seen.size() > 2)) {
        ends.push_back({at.cost_s, at.arc_um, at.weight, from_W});
        continue;
      }
      const auto incident = at.tile->incident(at.index);
      for (const std::uint32_t s : incident) {
        if (budget == 0) break;
        --budget;
        const std::uint32_t other = at.tile->child(s) == at.index ? at.tile->parent(s) : at.tile->child(s);
        const NodeId id = at.tile->nodeId(other);
        if (seen.contains(id.key())) continue;
        const Vector3d way = at.tile->position_W(other) - from_W;
        const double length = way.norm();
        const Vector3d way_W = length > 0 ? Vector3d(way / length) : at.way_W;
        double weight = at.weight;
        if (at.way_W.isZero(0)) {
          weight = 0.5 * (1 + kBack) - 0.5 * (kBack - 1) * way_W.dot(heading);
        } else if (incident.size() > 2) {
          weight = std::min(kMost, weight * (0.5 * (1 + kTurn) - 0.5 * (kTurn - 1) * way_W.dot(at.way_W)));
        }
        queue.push({at.cost_s + length * weight / pace_um_s, at.arc_um + length, weight, id, at.tile, other, way_W});
      }
    }
  } else if (!cell_tiles.empty()) {
    ends.push_back({0, 0, 1, focus.p_W});  // the tile itself is being loaded
  }

  // Tiles that the walk did not reach: by the nearest end, in time.
  std::sort(ends.begin(), ends.end(), [](const End& a, const End& b) { return a.cost_s < b.cost_s; });
  if (ends.size() > kMaxEnds) ends.resize(kMaxEnds);
  for (const TileId id : cell_tiles) {
    if (ends.empty() || id >= store_.tile_count() || cost.contains(id)) continue;
    const bool is_known = store_.knows(id);
    const double most_um = is_known ? reach_um : kPagesAhead * reach_um;
    double best = std::numeric_limits<double>::infinity();
    const WorldBox box = boxOf(id);
    for (const End& end : ends) {
      if (end.cost_s >= best) break;
      const Vector3d way_W = wayTo(box, end.p_W);
      const double way_um = way_W.norm();
      if (end.arc_um + way_um >= most_um) continue;
      const double aside_um = 0.5 * (kAsideFactor - 1) * (way_um - way_W.dot(heading));
      best = std::min(best, end.cost_s + end.weight * (way_um + aside_um) / pace_um_s);
    }
    if (!std::isfinite(best)) continue;
    store_.setCost(best);
    if (is_known || store_.find(id) != nullptr) cost.emplace(id, best);
  }

  const std::size_t first = claims.size();
  for (const auto& [id, seconds] : cost) claims.push_back({id, seconds});
  std::sort(
      claims.begin() + static_cast<std::ptrdiff_t>(first), claims.end(),
      [](const TileClaim& a, const TileClaim& b) { return a.cost != b.cost ? a.cost < b.cost : a.tile < b.tile; });
  std::uint64_t bytes = 0;
  std::size_t fits = first;
  while (fits < claims.size() && (bytes += store_.entry(claims[fits].tile).decoded_bytes) <= budget_bytes) ++fits;
  claims.resize(std::max(fits, std::min(claims.size(), first + 1)));
}

bool Prefetch::claimAround(const ReaderFocus& focus, std::uint64_t budget_bytes, std::vector<TileClaim>& claims) const {
  if (policy_ == PrefetchPolicy::none || !focus.p_W.allFinite() || !std::isfinite(focus.radius_um) ||
      !(focus.radius_um > 0))
    return true;
  const bool follows = policy_ == PrefetchPolicy::structure && !focus.is_view && focus.active_tile != kNoTile;
  const double reach_um = (follows ? kAroundOnStructure * timePart() : 1) * focus.radius_um;
  store_.setCost(lookahead_s_);
  std::uint64_t bytes = 0;
  try {
    TileFinder::Walk walk = finder_.walk(focus.p_W);
    for (std::size_t n = 0; n < kMaxWorkspaceTiles; ++n) {
      const std::optional<TileFinder::Hit> hit = walk.next(reach_um * reach_um);
      if (!hit) return true;
      bytes += store_.entry(hit->tile).decoded_bytes;
      if (bytes > budget_bytes) return true;
      claims.push_back({hit->tile, std::sqrt(hit->squared_distance)});
    }
  } catch (const internal::PageAbsent&) {
    return false;
  }
  return true;
}

}  // namespace filiform
