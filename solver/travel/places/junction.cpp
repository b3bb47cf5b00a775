#include "solver/travel/places/junction.h"

#include <algorithm>
#include <cmath>

namespace filiform {

namespace {

class Walk {
 public:
  Walk(const GraphView& graph, std::uint32_t most, SomaFinder* somata, std::vector<TileId>& absent)
      : graph_(graph), left_(most), somata_(somata), absent_(absent) {}

  // The node at the given end of a segment, in its home. Adds an absent home to `absent`.
  GraphView::HomeNode end(const Tile& tile, std::uint32_t node) {
    const GraphView::HomeNode home = graph_.home(tile, node);
    if (home.frontier() && std::find(absent_.begin(), absent_.end(), home.home) == absent_.end())
      absent_.push_back(home.home);
    return home;
  }
  // The branches at a node, in the order of their segments' ids. `at` must be the home.
  std::vector<std::uint32_t> branches(const GraphView::HomeNode& at) {
    const Tile& tile = *at.tile;
    std::vector<std::uint32_t> segments;
    for (const std::uint32_t segment : tile.incident(at.node)) segments.push_back(segment);
    if (somata_ == nullptr || segments.size() < 3) return segments;
    const auto soma = somata_->ofIfReadable(tile.nodeId(at.node), tile.gridPoint(at.node));
    if (soma)
      std::erase_if(segments,
                    [&](std::uint32_t segment) { return soma->isDeadEnd(tile.nodeId(tile.child(segment)).sample); });
    return segments;
  }
  bool spend() { return left_ > 0 && left_-- > 0; }

 private:
  const GraphView& graph_;
  std::uint32_t left_;
  SomaFinder* somata_;
  std::vector<TileId>& absent_;
};

// A step along a segment, from one of its ends to the other.
struct SegmentStep {
  const Tile* tile;
  std::uint32_t segment;
  std::uint32_t to;  // node in `tile`
};

SegmentStep stepFrom(const GraphView::HomeNode& at, std::uint32_t segment) {
  const std::uint32_t child = at.tile->child(segment), parent = at.tile->parent(segment);
  return {at.tile, segment, child == at.node ? parent : child};
}

// The first node with more than two segments.
struct Fork {
  GraphView::HomeNode at;
  SegmentId by;  // the segment that leads there
  double distance_um;
};

std::optional<Fork> forkAhead(Walk& walk, const Tile* tile, std::uint32_t segment, std::uint32_t to, double distance_um,
                              double reach_um) {
  while (distance_um <= reach_um && walk.spend()) {
    const GraphView::HomeNode at = walk.end(*tile, to);
    if (!at.present()) return {};
    const SegmentId by = tile->segmentId(segment);
    const std::vector<std::uint32_t> segments = walk.branches(at);
    if (segments.size() > 2) return Fork{at, by, distance_um};
    const auto isBy = [&](std::uint32_t candidate) { return at.tile->segmentId(candidate) == by; };
    if (std::none_of(segments.begin(), segments.end(), isBy)) {
      // The search came from a sample that only gives the soma its shape: continue along each neurite.
      std::optional<Fork> best;
      for (const std::uint32_t neurite : segments) {
        const SegmentStep step = stepFrom(at, neurite);
        const double step_um = (step.tile->position_W(step.to) - at.tile->position_W(at.node)).norm();
        const std::optional<Fork> fork = forkAhead(walk, step.tile, neurite, step.to, distance_um + step_um, reach_um);
        if (fork && (!best || fork->distance_um < best->distance_um)) best = fork;
      }
      return best;
    }
    if (segments.size() < 2) return {};
    const std::uint32_t next = at.tile->segmentId(segments[0]) == by ? segments[1] : segments[0];
    const SegmentStep step = stepFrom(at, next);
    distance_um += (step.tile->position_W(step.to) - at.tile->position_W(at.node)).norm();
    tile = step.tile;
    segment = step.segment;
    to = step.to;
  }
  return {};
}

Branch traceBranch(Walk& walk, const GraphView::HomeNode& from, std::uint32_t segment, double length_um) {
  Branch branch;
  branch.first = from.tile->segmentId(segment);
  branch.points_W.push_back(from.tile->position_W(from.node));
  SegmentStep step = stepFrom(from, segment);
  double length = 0;
  while (true) {
    const Vector3d from_W = branch.points_W.back(), to_W = step.tile->position_W(step.to);
    const double more = (to_W - from_W).norm();
    if (length + more >= length_um) {
      branch.points_W.push_back(from_W + (to_W - from_W) * ((length_um - length) / more));
      break;
    }
    branch.points_W.push_back(to_W);
    length += more;
    if (!walk.spend()) break;
    const GraphView::HomeNode at = walk.end(*step.tile, step.to);
    if (!at.present()) break;
    const std::vector<std::uint32_t> segments = walk.branches(at);
    if (segments.size() != 2) break;
    const SegmentId by = step.tile->segmentId(step.segment);
    step = stepFrom(at, at.tile->segmentId(segments[0]) == by ? segments[1] : segments[0]);
  }
  return branch;
}

}  // namespace

JunctionSearch findJunction(const GraphView& graph, const ProxyPlace& place, const Vector3d& heading_W, double reach_um,
                            double length_um, std::uint32_t most_segments, SomaFinder* somata) {
  JunctionSearch search;
  if (!place.valid()) return search;
  const GraphView::SegmentRef on = graph.segment(place.tile, place.segment);
  if (!on) {
    search.absent.push_back(place.tile);
    return search;
  }
  Walk walk(graph, most_segments, somata, search.absent);

  std::optional<Fork> best;
  const std::uint32_t ends[] = {on.tile->child(on.segment), on.tile->parent(on.segment)};
  bool best_ahead = false;
  for (int side = 0; side < 2; ++side) {
    const std::uint32_t to = ends[side];
    const Vector3d way = on.tile->position_W(to) - place.p_W;
    std::optional<Fork> fork = forkAhead(walk, on.tile, on.segment, to, way.norm(), reach_um);
    if (!fork) continue;
    const Vector3d along = on.tile->position_W(to) - on.tile->position_W(ends[1 - side]);
    const bool ahead = heading_W.dot(along) > 0;
    const bool better = !best || (ahead != best_ahead ? ahead : fork->distance_um < best->distance_um);
    if (!better) continue;
    best = fork;
    best_ahead = ahead;
  }
  if (!best) return search;

  Junction junction;
  junction.node = best->at.tile->nodeId(best->at.node);
  junction.p_W = best->at.tile->position_W(best->at.node);
  junction.distance_um = best->distance_um;
  for (const std::uint32_t segment : walk.branches(best->at)) {
    Branch branch = traceBranch(walk, best->at, segment, length_um);
    branch.own = branch.first == best->by;
    junction.branches.push_back(std::move(branch));
  }
  search.junction = std::move(junction);
  return search;
}

}  // namespace filiform
