#include "viewer/glyph.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

namespace filiform {

namespace {

class Walk {
 public:
  Walk(const GraphView& graph, std::uint32_t most, SomaFinder* somata, std::vector<TileId>& absent)
      : graph_(graph), left_(most), somata_(somata), absent_(absent) {}

  // The node at the given end of a segment, in its home; not present: the reason is noted.
  GraphView::HomeNode end(const Tile& tile, std::uint32_t node) {
    const GraphView::HomeNode home = graph_.home(tile, node);
    if (home.frontier() && std::find(absent_.begin(), absent_.end(), home.home) == absent_.end())
      absent_.push_back(home.home);
    return home;
  }
  // The branches at a node in its home, in the order of their segments' ids.
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

// Where one comes to by a segment from one of its ends.
struct Step {
  const Tile* tile;
  std::uint32_t segment;
  std::uint32_t to;  // node in `tile`
};

Step stepFrom(const GraphView::HomeNode& at, std::uint32_t segment) {
  const std::uint32_t child = at.tile->child(segment), parent = at.tile->parent(segment);
  return {at.tile, segment, child == at.node ? parent : child};
}

// The first node with other than two segments.
struct Fork {
  GraphView::HomeNode at;
  SegmentId by;  // by which one comes there
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
      // From a sample that only gives the soma its shape: on along the one neurite, or both.
      std::optional<Fork> best;
      for (const std::uint32_t neurite : segments) {
        const Step step = stepFrom(at, neurite);
        const double step_um = (step.tile->position_W(step.to) - at.tile->position_W(at.node)).norm();
        const std::optional<Fork> fork = forkAhead(walk, step.tile, neurite, step.to, distance_um + step_um, reach_um);
        if (fork && (!best || fork->distance_um < best->distance_um)) best = fork;
      }
      return best;
    }
    if (segments.size() < 2) return {};
    const std::uint32_t next = at.tile->segmentId(segments[0]) == by ? segments[1] : segments[0];
    const Step step = stepFrom(at, next);
    distance_um += (step.tile->position_W(step.to) - at.tile->position_W(at.node)).norm();
    tile = step.tile;
    segment = step.segment;
    to = step.to;
  }
  return {};
}

Branch followBranch(Walk& walk, const GraphView::HomeNode& from, std::uint32_t segment, double length_um) {
  Branch branch;
  branch.first = from.tile->segmentId(segment);
  branch.points_W.push_back(from.tile->position_W(from.node));
  Step step = stepFrom(from, segment);
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

class Shape {
 public:
  void cone(const Vector3d& a, double a_radius, const Vector3d& b, double b_radius, Rgba colour) {
    DrawnSegment s{};
    for (int axis = 0; axis < 3; ++axis) {
      s.a_um[axis] = static_cast<float>(a[axis]);
      s.b_um[axis] = static_cast<float>(b[axis]);
    }
    s.a_radius_um = static_cast<float>(a_radius);
    s.b_radius_um = static_cast<float>(b_radius);
    s.colour = colour;
    batch.segments.push_back(s);
    const double most = std::max(a_radius, b_radius);
    batch.lo_W = batch.lo_W.cwiseMin(a.cwiseMin(b) - Vector3d::Constant(most));
    batch.hi_W = batch.hi_W.cwiseMax(a.cwiseMax(b) + Vector3d::Constant(most));
    batch.largest_radius_um = std::max(batch.largest_radius_um, static_cast<float>(most));
  }
  ThreadBatch batch;
};

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
    Branch branch = followBranch(walk, best->at, segment, length_um);
    branch.own = branch.first == best->by;
    junction.branches.push_back(std::move(branch));
  }
  search.junction = std::move(junction);
  return search;
}

ThreadBatch glyphBatch(const Junction& junction, double length_um, double line_um, const GlyphPalette& palette) {
  Shape shape;
  shape.batch.origin_W = shape.batch.lo_W = shape.batch.hi_W = junction.p_W;
  shape.batch.lo_W.setZero();
  shape.batch.hi_W.setZero();
  for (const Branch& branch : junction.branches) {
    double drawn_um = 0;
    for (std::size_t i = 1; i < branch.points_W.size(); ++i)
      drawn_um += (branch.points_W[i] - branch.points_W[i - 1]).norm();
    if (!(drawn_um > 0)) continue;
    const double stretch = length_um / drawn_um, radius = (branch.own ? 1.8 : 1.0) * line_um / 2;
    const Rgba colour = branch.own ? palette.own : palette.other;
    // The line ends where the head begins.
    const double head_um = std::min(0.3 * length_um, (branch.own ? 5.0 : 6.0) * line_um);
    double left = length_um - head_um;
    Vector3d at = Vector3d::Zero(), way = Vector3d::UnitX();
    for (std::size_t i = 1; i < branch.points_W.size() && left > 0; ++i) {
      const Vector3d step = stretch * (branch.points_W[i] - branch.points_W[i - 1]);
      const double length = step.norm();
      if (!(length > 0)) continue;
      way = step / length;
      const Vector3d to = at + std::min(length, left) * way;
      shape.cone(at, radius, to, radius, colour);
      at = to;
      left -= length;
    }
    if (branch.own) {
      shape.cone(at, 0.4 * head_um, at + head_um * way, 0.02 * head_um, colour);
    } else {
      constexpr int kSides = 16;
      const Vector3d u = way.unitOrthogonal(), v = way.cross(u), middle = at + 0.5 * head_um * way;
      // Two rings across each other, so that one is open to the eye from anywhere.
      for (const Vector3d& across : {u, v})
        for (int i = 0; i < kSides; ++i) {
          const auto on_ring = [&](int k) -> Vector3d {
            const double angle = 2 * std::numbers::pi * k / kSides;
            return middle + 0.5 * head_um * (std::cos(angle) * way + std::sin(angle) * across);
          };
          shape.cone(on_ring(i), 0.7 * radius, on_ring(i + 1), 0.7 * radius, colour);
        }
    }
  }
  shape.batch.lo_W += junction.p_W;
  shape.batch.hi_W += junction.p_W;
  return std::move(shape.batch);
}

}  // namespace filiform
