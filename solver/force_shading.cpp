#include "solver/force_shading.h"

#include "index/closest_point.h"
#include "solver/graph_view.h"
#include "solver/internal/active_segment.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace filiform {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::uint32_t kNoSegment = UINT32_MAX;

class ForceShading final : public ProxySolver {
 public:
  explicit ForceShading(const SolverParameters& parameters) : most_looks_(parameters.max_visited) {}

  const ProxyPlace& place() const noexcept override { return state_.place; }
  void setPlace(const ProxyPlace& place) noexcept override {
    state_ = State{};
    state_.place = place;
    before_ = state_;
  }
  void advance(const GraphView& graph, const ProbeState& probe, SolverStep& step) noexcept override;
  void undo() noexcept override { state_ = before_; }

 private:
  struct State {
    ProxyPlace place;
    std::uint32_t segment = 0;  // the place's, where it was last in its tile
  };
  struct Tick {
    const GraphView& graph;
    const Vector3d& h_W;
    SolverStep& step;
    std::uint32_t looks = 0;
  };
  struct Shaded {  // an end of a segment
    Vector3d direction = Vector3d::Zero();
    GraphView::HomeNode home;
    std::uint32_t nearest = kNoSegment;  // of the other incident segments, in the home tile
  };
  struct Walk {
    const Tile* tile;
    std::uint32_t segment;  // in `tile`
    double t;
  };
  enum class Way : std::uint8_t { rests, by_child, by_parent };

  Shaded shade(Tick& tick, const Tile& tile, std::uint32_t segment, bool at_parent) const noexcept;
  bool leadsOn(Tick& tick, const Tile& tile, std::uint32_t segment, bool from_parent) const noexcept;
  bool leave(Tick& tick, const Shaded& end, Walk& walk) const noexcept;
  bool pass(Tick& tick, Walk& walk) const noexcept;

  std::uint32_t most_looks_;
  State state_, before_;
};

Vector3d unitAlong(const Tile& tile, std::uint32_t segment) noexcept {
  return (tile.position_W(tile.parent(segment)) - tile.position_W(tile.child(segment))).normalized();
}

// Where u goes under f(u) = a0 + a1 u + a2 u^2: to the zero at which f falls, unless the one at which it rises lies
// between. Only the latter is compared with u, where u never rests: so rounding cannot push it off its place.
double shadedGoal(double a0, double a1, double a2, double u) noexcept {
  const double size = std::max({std::abs(a0), std::abs(a1), std::abs(a2)});
  if (!(size > 0.0) || !std::isfinite(size)) return u;
  a0 /= size;
  a1 /= size;
  a2 /= size;
  if (a2 == 0.0) {
    if (a1 < 0.0) return -a0 / a1;
    if (a1 > 0.0) return u > -a0 / a1 ? kInfinity : -kInfinity;
    return a0 > 0.0 ? kInfinity : -kInfinity;
  }
  const double discriminant = a1 * a1 - 4.0 * a2 * a0;
  if (discriminant < 0.0) return a2 > 0.0 ? kInfinity : -kInfinity;
  const double half = -0.5 * (a1 + std::copysign(std::sqrt(discriminant), a1));
  const double r1 = half / a2, r2 = half == 0.0 ? 0.0 : a0 / half;
  const double lo = std::min(r1, r2), hi = std::max(r1, r2);
  if (a2 < 0.0) return u > lo ? hi : -kInfinity;
  return u < hi ? lo : kInfinity;
}

void ForceShading::advance(const GraphView& graph, const ProbeState& probe, SolverStep& step) noexcept {
  internal::clear(step);
  before_ = state_;
  if (!state_.place.valid() || !internal::usableDistance((state_.place.p_W - probe.h_W).squaredNorm())) return;
  Tick tick{graph, probe.h_W, step};
  const GraphView::SegmentRef active = internal::activeSegment(graph, state_.place, state_.segment, step);
  if (!active) return;

  Walk walk{active.tile, active.segment, state_.place.t};
  for (bool goes_on = true; goes_on && step.visited < kMostShadedSegments;) {
    ++step.visited;
    const Tile& tile = *walk.tile;
    const Vector3d child_W = tile.position_W(tile.child(walk.segment));
    const Vector3d parent_W = tile.position_W(tile.parent(walk.segment));
    if (child_W == parent_W) {
      goes_on = pass(tick, walk);
      continue;
    }
    const Shaded child = shade(tick, tile, walk.segment, false), parent = shade(tick, tile, walk.segment, true);
    const Vector3d along_W = parent_W - child_W, pull_W = probe.h_W - child_W;
    const Vector3d turn = parent.direction - child.direction;
    const double goal = shadedGoal(pull_W.dot(child.direction), pull_W.dot(turn) - along_W.dot(child.direction),
                                   -along_W.dot(turn), walk.t);
    walk.t = std::clamp(goal, 0.0, 1.0) + 0.0;  // never -0
    goes_on = goal < 0.0 ? leave(tick, child, walk) : goal > 1.0 && leave(tick, parent, walk);
  }
  const ProxyPlace& place = state_.place;
  if (walk.tile == active.tile && walk.segment == active.segment && walk.t == place.t) return;
  const Vector3d child_W = walk.tile->position_W(walk.tile->child(walk.segment));
  const Vector3d parent_W = walk.tile->position_W(walk.tile->parent(walk.segment));
  state_.place = graph.placeOn(*walk.tile, walk.segment, walk.t,
                               walk.t == 1.0 ? parent_W : child_W + walk.t * (parent_W - child_W));
  state_.segment = walk.segment;
}

ForceShading::Shaded ForceShading::shade(Tick& tick, const Tile& tile, std::uint32_t segment,
                                         bool at_parent) const noexcept {
  Shaded end;
  const std::uint32_t met = at_parent ? tile.parent(segment) : tile.child(segment);
  const SegmentId id = tile.segmentId(segment);
  end.direction = unitAlong(tile, segment);
  end.home = tick.graph.home(tile, met);
  if (!end.home.present()) {
    ++tick.step.frontiers;
    if (end.home.frontier()) tick.step.absent.add(end.home.home);
    return end;
  }
  const Tile& home = *end.home.tile;
  tick.step.touched.add(end.home.home);
  const auto incident = home.incident(end.home.node);
  const Vector3d node_W = home.position_W(end.home.node);
  // Nearest first; those of equal ends are a way on, but have no direction.
  double nearest2 = kInfinity, near2[2] = {kInfinity, kInfinity};
  Vector3d near_far_W[2] = {node_W, node_W};
  for (const std::uint32_t other : incident) {
    if (home.segmentId(other) == id) continue;
    if (tick.looks == most_looks_) {
      tick.step.capped = true;
      break;
    }
    ++tick.looks;
    const Vector3d child_W = home.position_W(home.child(other)), parent_W = home.position_W(home.parent(other));
    const double d2 = closestPoint(child_W, parent_W, tick.h_W).squared_distance;
    if (d2 < nearest2) {
      nearest2 = d2;
      end.nearest = other;
    }
    if (child_W == parent_W) continue;
    const Vector3d& far_W = home.child(other) == end.home.node ? parent_W : child_W;
    if (d2 < near2[0]) {
      near2[1] = near2[0];
      near_far_W[1] = near_far_W[0];
      near2[0] = d2;
      near_far_W[0] = far_W;
    } else if (d2 < near2[1]) {
      near2[1] = d2;
      near_far_W[1] = far_W;
    }
  }
  Vector3d sum = end.direction;
  for (int i = 0; i < 2; ++i) {
    if (near2[i] == kInfinity) break;
    sum += (at_parent ? near_far_W[i] - node_W : node_W - near_far_W[i]).normalized();
  }
  if (sum.squaredNorm() > 0.0) end.direction = sum.normalized();
  return end;
}

// Does f lead on from this end of the segment, into it?
bool ForceShading::leadsOn(Tick& tick, const Tile& tile, std::uint32_t segment, bool from_parent) const noexcept {
  const Shaded end = shade(tick, tile, segment, from_parent);
  const Vector3d node_W = tile.position_W(from_parent ? tile.parent(segment) : tile.child(segment));
  const double f = (tick.h_W - node_W).dot(end.direction);
  return from_parent ? f < 0.0 : f > 0.0;
}

// Onto the nearest of the other segments at this end, if there f leads on; a segment of equal ends always does.
bool ForceShading::leave(Tick& tick, const Shaded& end, Walk& walk) const noexcept {
  if (!end.home.present() || end.nearest == kNoSegment) return false;
  const Tile& home = *end.home.tile;
  const bool from_parent = home.child(end.nearest) != end.home.node;
  const Vector3d child_W = home.position_W(home.child(end.nearest)),
                 parent_W = home.position_W(home.parent(end.nearest));
  if (child_W != parent_W && !leadsOn(tick, home, end.nearest, from_parent)) return false;
  walk = {&home, end.nearest, from_parent ? 1.0 : 0.0};
  return true;
}

// Across a segment of equal ends: on by the end that it was not entered from; from its child's where that is no way.
bool ForceShading::pass(Tick& tick, Walk& walk) const noexcept {
  const bool from_parent = walk.t == 1.0;
  const Walk entered = walk;
  if (leave(tick, shade(tick, *entered.tile, entered.segment, !from_parent), walk)) return true;
  return leave(tick, shade(tick, *entered.tile, entered.segment, from_parent), walk);
}

}  // namespace

std::unique_ptr<ProxySolver> makeForceShading(const SolverParameters& parameters) {
  return std::make_unique<ForceShading>(parameters);
}

}  // namespace filiform
