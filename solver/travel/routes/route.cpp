#include "solver/travel/routes/route.h"

#include "index/cell/cell.h"
#include "index/errors.h"
#include "index/query/cell_graph.h"
#include "index/text.h"
#include "solver/travel/routes/internal/draw.h"

#include <algorithm>
#include <optional>
#include <random>
#include <utility>

namespace filiform {

std::vector<std::uint32_t> parentsFirst(const std::vector<std::uint32_t>& parents) {
  std::vector<std::uint32_t> order, climb;
  order.reserve(parents.size());
  std::vector<bool> done(parents.size(), false);
  for (std::uint32_t rank = 0; rank < parents.size(); ++rank) {
    for (std::uint32_t at = rank; at != kNoParent && !done[at]; at = parents[at]) {
      done[at] = true;
      climb.push_back(at);
    }
    order.insert(order.end(), climb.rbegin(), climb.rend());
    climb.clear();
  }
  return order;
}

namespace {

constexpr std::uint32_t kNone = UINT32_MAX;

struct Forest {
  std::vector<std::uint32_t> root;  // by rank
  std::vector<double> depth_um;     // by rank: arc length from the root
  std::vector<bool> is_tip;         // by rank: has a parent, no child, and is not part of a soma's shape
};

Forest measure(const CellGraph& graph) {
  const std::size_t samples = graph.parents.size();
  Forest forest{std::vector<std::uint32_t>(samples), std::vector<double>(samples, 0.0),
                std::vector<bool>(samples, false)};
  for (std::uint32_t rank = 0; rank < samples; ++rank) forest.is_tip[rank] = graph.parents[rank] != kNoParent;
  for (const std::uint32_t rank : parentsFirst(graph.parents)) {
    const std::uint32_t parent = graph.parents[rank];
    if (parent == kNoParent) {
      forest.root[rank] = rank;
      continue;
    }
    forest.root[rank] = forest.root[parent];
    forest.depth_um[rank] = forest.depth_um[parent] + (graph.position_W(rank) - graph.position_W(parent)).norm();
    forest.is_tip[parent] = false;
  }
  for (const Soma& soma : graph.somata.somata)
    for (const std::uint32_t rank : soma.dead_ends) forest.is_tip[rank] = false;
  return forest;
}

using PathEnds = std::pair<std::uint32_t, std::uint32_t>;

PathEnds longest(const Forest& forest) {
  PathEnds best{kNone, kNone};
  double best_um = 0;
  for (std::uint32_t rank = 0; rank < forest.root.size(); ++rank) {
    if (!forest.is_tip[rank]) continue;
    const double depth_um = forest.depth_um[rank];
    const PathEnds ends{forest.root[rank], rank};
    if (depth_um > best_um || (depth_um == best_um && depth_um > 0 && ends < best)) {
      best = ends;
      best_um = depth_um;
    }
  }
  if (best.first == kNone)
    throw UsageError("the cell has no route: none of its segments has a length (a soma has none)");
  return best;
}

std::optional<PathEnds> randomEnds(const Forest& forest, std::uint64_t seed) {
  // A route needs a tip that is at some distance from its root.
  std::vector<std::uint32_t> roots;
  for (std::uint32_t rank = 0; rank < forest.root.size(); ++rank)
    if (forest.is_tip[rank] && forest.depth_um[rank] > 0) roots.push_back(forest.root[rank]);
  std::sort(roots.begin(), roots.end());
  roots.erase(std::unique(roots.begin(), roots.end()), roots.end());
  if (roots.empty()) return std::nullopt;
  std::mt19937_64 random(seed);
  const std::uint32_t root = roots[internal::drawBelow(random, roots.size())];
  std::vector<std::uint32_t> tips;
  for (std::uint32_t rank = 0; rank < forest.root.size(); ++rank)
    if (forest.root[rank] == root && forest.is_tip[rank] && forest.depth_um[rank] > 0) tips.push_back(rank);
  return PathEnds{root, tips[internal::drawBelow(random, tips.size())]};
}

PathEnds byIds(const CellGraph& graph, const Forest& forest, std::int64_t first_id, std::int64_t last_id) {
  std::vector<std::uint32_t> firsts, lasts;
  for (std::uint32_t rank = 0; rank < graph.sample_ids.size(); ++rank) {
    if (graph.sample_ids[rank] == first_id) firsts.push_back(rank);
    if (graph.sample_ids[rank] == last_id) lasts.push_back(rank);
  }
  if (firsts.empty() || lasts.empty())
    throw UsageError("the cell has no sample " + std::to_string(firsts.empty() ? first_id : last_id) +
                     "; a route FIRST:LAST takes sample ids from the file");
  for (const std::uint32_t first : firsts)
    for (const std::uint32_t last : lasts)
      if (forest.root[first] == forest.root[last]) return {first, last};
  throw UsageError("samples " + std::to_string(first_id) + " and " + std::to_string(last_id) +
                   " are not connected; choose two samples of one tree");
}

}  // namespace

Route::Route(std::uint32_t cell, const Grid& grid, const std::vector<GridPoint>& positions,
             std::vector<std::uint32_t> parents, std::uint32_t first, std::uint32_t last,
             std::vector<std::array<std::uint32_t, 2>> links)
    : cell_(cell),
      parents_(std::move(parents)),
      links_(std::move(links)),
      route_index_(parents_.size(), kNone),
      on_route_(parents_.size(), false) {
  // Climbs from both ends. The paths meet at the first sample above `last` that is also above `first`.
  std::vector<bool> above_first(parents_.size(), false);
  for (std::uint32_t at = first; at != kNoParent; at = parents_[at]) above_first[at] = true;
  std::vector<std::uint32_t> down;
  std::uint32_t meeting = last;
  for (; meeting != kNoParent && !above_first[meeting]; meeting = parents_[meeting]) down.push_back(meeting);
  if (meeting == kNoParent) throw UsageError("the two ends of the route are not connected");
  std::vector<std::uint32_t> ranks;
  for (std::uint32_t at = first; at != meeting; at = parents_[at]) ranks.push_back(at);
  ranks.push_back(meeting);
  ranks.insert(ranks.end(), down.rbegin(), down.rend());

  double arc_um = 0;
  for (const std::uint32_t rank : ranks) {
    const Vector3d p_W = grid.toWorld(positions[rank]);
    if (!points_.empty()) {
      const Vector3d step = p_W - points_.back().p_W;
      arc_um += step.norm();
      if (!step.isZero(0)) beyond_ = step.normalized();
    }
    route_index_[rank] = static_cast<std::uint32_t>(points_.size());
    on_route_[rank] = true;
    points_.push_back({rank, p_W, arc_um});
  }
  if (!(arc_um > 0)) throw UsageError("the route has no length; choose two samples at different places");

  // Every sample below the route leaves it at its nearest ancestor on the route. All other samples of the tree leave it
  // at the meeting point, which is the highest point of the route.
  const std::vector<std::uint32_t> order = parentsFirst(parents_);
  std::vector<std::uint32_t> root(parents_.size());
  for (const std::uint32_t rank : order) root[rank] = parents_[rank] == kNoParent ? rank : root[parents_[rank]];
  for (const std::uint32_t rank : order) {
    if (on_route_[rank] || root[rank] != root[meeting]) continue;
    const std::uint32_t parent = parents_[rank];
    route_index_[rank] = parent == kNoParent ? route_index_[meeting] : route_index_[parent];
  }
}

SegmentId Route::first_segment() const {
  const std::uint32_t a = points_[0].rank, b = points_[1].rank;
  for (std::uint32_t s = 0; s < links_.size(); ++s)
    if (links_[s] == std::array{a, b} || links_[s] == std::array{b, a}) return {cell_, s};
  return {cell_, parents_[a] == b ? a : b};
}

double Route::first_t() const {
  const std::uint32_t first = points_[0].rank;
  if (links_.empty()) return parents_[first] == points_[1].rank ? 0.0 : 1.0;
  return links_[first_segment().segment][0] == first ? 0.0 : 1.0;
}

Vector3d Route::pointAt(double arc_um) const noexcept {
  if (!(arc_um > 0)) return points_.front().p_W;
  const Point& last = points_.back();
  if (arc_um >= last.arc_um) return last.p_W + (arc_um - last.arc_um) * beyond_;
  const auto next = std::upper_bound(points_.begin(), points_.end(), arc_um,
                                     [](double arc, const Point& point) { return arc < point.arc_um; });
  const Point &b = *next, &a = *(next - 1);
  return a.p_W + (arc_um - a.arc_um) / (b.arc_um - a.arc_um) * (b.p_W - a.p_W);
}

Route::Progress Route::progress(const ProxyPlace& place) const noexcept {
  const std::uint32_t cell = place.at_node ? place.node.cell : place.segment.cell;
  std::uint32_t rank = place.at_node ? place.node.sample : place.segment.segment;
  if (!place.valid() || cell != cell_) return {};
  if (!links_.empty() && !place.at_node) {
    if (rank >= links_.size()) return {};
    const auto [child, parent] = links_[rank];
    rank = child;
    // A link that closes a loop is not on the route. It leads back to the route from its nearer end.
    if (child < parents_.size() && parents_[child] != parent) {
      const std::uint32_t nearer = place.t < 0.5 ? child : parent;
      if (nearer >= parents_.size() || route_index_[nearer] == kNone) return {};
      return {points_[route_index_[nearer]].arc_um, false, true};
    }
  }
  if (rank >= parents_.size() || route_index_[rank] == kNone) return {};
  const double arc_um = points_[route_index_[rank]].arc_um;
  if (place.at_node) return {arc_um, on_route_[rank], true};
  const std::uint32_t parent = parents_[rank];
  if (parent == kNoParent) return {arc_um, on_route_[rank], true};
  const double parent_arc_um = points_[route_index_[parent]].arc_um;
  if (on_route_[rank] && on_route_[parent]) return {arc_um + place.t * (parent_arc_um - arc_um), true, true};
  // Off the route, a segment leads back to the same point as its nearer end. Child and parent differ only at the
  // meeting point.
  return {on_route_[rank] ? arc_um : parent_arc_um, false, true};
}

Route::Progress RouteTracker::update(const ProxyPlace& place) noexcept {
  const Route::Progress progress = route_.progress(place);
  if (progress.on_route) reached_um_ = std::max(reached_um_, progress.arc_um);
  return progress;
}

Route planRoute(const CellGraph& graph, std::uint32_t cell, const RouteChoice& choice) {
  const Forest forest = measure(graph);
  std::optional<PathEnds> ends;
  switch (choice.kind) {
    case RouteChoice::Kind::longest:
      ends = longest(forest);
      break;
    case RouteChoice::Kind::between:
      ends = byIds(graph, forest, choice.first, choice.last);
      break;
    case RouteChoice::Kind::random:
      ends = randomEnds(forest, choice.seed);
      break;
    case RouteChoice::Kind::tour:
      throw UsageError("a tour is no route of one cell: choose longest, FIRST:LAST or random:SEED");
  }
  if (!ends) throw UsageError("the cell has no route: none of its segments has a length (a soma has none)");
  return Route(cell, graph.grid, graph.positions, graph.parents, ends->first, ends->second, graph.links);
}

std::optional<Route> planRandomRoute(const CellGraph& graph, std::uint32_t cell, std::uint64_t seed) {
  const std::optional<PathEnds> ends = randomEnds(measure(graph), seed);
  if (!ends) return std::nullopt;
  return Route(cell, graph.grid, graph.positions, graph.parents, ends->first, ends->second, graph.links);
}

}  // namespace filiform
