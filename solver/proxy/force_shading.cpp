#include "solver/proxy/force_shading.h"

#include "index/geometry/closest_point.h"
#include "solver/graph/graph_view.h"
#include "solver/graph/internal/working_graph.h"
#include "solver/proxy/internal/active_segment.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace filiform {

namespace {

constexpr double kUnbounded = std::numeric_limits<double>::infinity();

using internal::ActiveSegment;
using internal::WorkingGraph;

// Nodes that a tick may label: both ends of each walked segment, and both ends of the segment after it.
constexpr std::uint32_t kMostLabelled = 4 * (kMostShadedSegments + 1);

class ForceShading final : public ProxySolver {
 public:
  explicit ForceShading(const SolverParameters& parameters)
      : most_looks_(parameters.max_visited), graph_(parameters.pool_nodes, kMostLabelled, 0) {}

  const ProxyPlace& place() const noexcept override { return place_; }
  void setPlace(const ProxyPlace& place) noexcept override {
    place_ = before_ = place;
    active_ = ActiveSegment{};
    graph_.forget();
  }
  void advance(const GraphView& graph, const ProbeState& probe, SolverStep& step) noexcept override;
  void undo() noexcept override { place_ = before_; }
  void prepare(const GraphView& graph, const Vector3d& ahead_W, std::uint32_t most) noexcept override {
    active_.prepare(graph_, graph, place_, ahead_W, most);
  }

 private:
  struct Tick {
    const Vector3d& h_W;
    SolverStep& step;
    std::uint32_t looks = 0;
  };
  struct Shaded {  // the shaded direction at an end of a segment
    Vector3d direction = Vector3d::Zero();
    std::uint32_t node = WorkingGraph::kNone;     // kNone: its home is absent
    std::uint32_t nearest = WorkingGraph::kNone;  // the other edge nearest to h
  };
  struct Walk {
    ActiveSegment segment;
    double t;
  };

  Shaded shade(Tick& tick, ActiveSegment& segment, bool at_parent) noexcept;
  bool leadsOn(Tick& tick, ActiveSegment& segment, bool from_parent) noexcept;
  bool leave(Tick& tick, const Shaded& end, Walk& walk) noexcept;
  bool pass(Tick& tick, Walk& walk) noexcept;

  std::uint32_t most_looks_;
  ProxyPlace place_, before_;
  WorkingGraph graph_;
  ActiveSegment active_;
};

// The u to which f(u) = a0 + a1 u + a2 u^2 leads: the zero at which f falls, unless the zero at which f rises lies
// between. u is compared only with the rising zero, at which u never rests, so rounding cannot move a resting u.
double shadedGoal(double a0, double a1, double a2, double u) noexcept {
  const double size = std::max({std::abs(a0), std::abs(a1), std::abs(a2)});
  if (!(size > 0.0) || !std::isfinite(size)) return u;
  a0 /= size;
  a1 /= size;
  a2 /= size;
  if (a2 == 0.0) {
    if (a1 < 0.0) return -a0 / a1;
    if (a1 > 0.0) return u > -a0 / a1 ? kUnbounded : -kUnbounded;
    return a0 > 0.0 ? kUnbounded : -kUnbounded;
  }
  const double discriminant = a1 * a1 - 4.0 * a2 * a0;
  if (discriminant < 0.0) return a2 > 0.0 ? kUnbounded : -kUnbounded;
  const double half = -0.5 * (a1 + std::copysign(std::sqrt(discriminant), a1));
  const double r1 = half / a2, r2 = half == 0.0 ? 0.0 : a0 / half;
  const double lo = std::min(r1, r2), hi = std::max(r1, r2);
  if (a2 < 0.0) return u > lo ? hi : -kUnbounded;
  return u < hi ? lo : kUnbounded;
}

void ForceShading::advance(const GraphView& graph, const ProbeState& probe, SolverStep& step) noexcept {
  step.clear();
  before_ = place_;
  if (!place_.valid() || !internal::usableDistance((place_.p_W - probe.h_W).squaredNorm())) return;
  graph_.begin(graph);
  if (!active_.moveTo(graph, place_, step)) return;
  graph_.newSearch();
  Tick tick{probe.h_W, step};

  Walk walk{active_, place_.t};
  for (bool goes_on = true; goes_on && step.visited < kMostShadedSegments;) {
    ++step.visited;
    const Vector3d& along_W = walk.segment.d_W;
    if (walk.segment.length2 == 0.0) {
      goes_on = pass(tick, walk);
      continue;
    }
    const Shaded child = shade(tick, walk.segment, false), parent = shade(tick, walk.segment, true);
    const Vector3d pull_W = probe.h_W - walk.segment.child.p_W, turn = parent.direction - child.direction;
    const double goal = shadedGoal(pull_W.dot(child.direction), pull_W.dot(turn) - along_W.dot(child.direction),
                                   -along_W.dot(turn), walk.t);
    walk.t = std::clamp(goal, 0.0, 1.0) + 0.0;  // never -0
    goes_on = goal < 0.0 ? leave(tick, child, walk) : goal > 1.0 && leave(tick, parent, walk);
  }
  const bool stays = walk.segment.tile == active_.tile && walk.segment.segment == active_.segment;
  active_ = walk.segment;
  if (stays && walk.t == place_.t) return;
  const Vector3d &child_W = active_.child.p_W, &parent_W = active_.parent.p_W;
  place_ = active_.place(graph, walk.t, walk.t == 1.0 ? parent_W : child_W + walk.t * active_.d_W);
}

ForceShading::Shaded ForceShading::shade(Tick& tick, ActiveSegment& segment, bool at_parent) noexcept {
  Shaded end;
  end.direction = segment.d_W.normalized();
  const std::uint32_t n = segment.meet(graph_, at_parent ? segment.parent : segment.child);
  static_cast<void>(graph_.label(n));
  const WorkingGraph::Presence presence = graph_.open(n);
  const WorkingGraph::Node& node = graph_.node(n);
  if (presence != WorkingGraph::Presence::present) {
    ++tick.step.frontiers;
    if (presence == WorkingGraph::Presence::absent) tick.step.absent.add(node.home);
    return end;
  }
  end.node = n;
  tick.step.touched.add(node.home);
  // The two nearest other segments, nearest first. Segments of length zero count as an exit, but have no direction.
  double nearest2 = kUnbounded, near2[2] = {kUnbounded, kUnbounded};
  Vector3d near_far_W[2] = {node.p_W, node.p_W};
  for (std::uint32_t i = 0; i < node.degree; ++i) {
    const WorkingGraph::Edge& edge = graph_.edge(n, i);
    if (edge.rank == segment.id.segment) continue;
    if (tick.looks == most_looks_) {
      tick.step.capped = true;
      break;
    }
    ++tick.looks;
    const double d2 = edge.closestTo(node.p_W, tick.h_W).squared_distance;
    if (d2 < nearest2) {
      nearest2 = d2;
      end.nearest = i;
    }
    if (edge.length2 == 0.0) continue;
    if (d2 < near2[0]) {
      near2[1] = near2[0];
      near_far_W[1] = near_far_W[0];
      near2[0] = d2;
      near_far_W[0] = edge.far_W;
    } else if (d2 < near2[1]) {
      near2[1] = d2;
      near_far_W[1] = edge.far_W;
    }
  }
  Vector3d sum = end.direction;
  for (int i = 0; i < 2; ++i) {
    if (near2[i] == kUnbounded) break;
    sum += (at_parent ? near_far_W[i] - node.p_W : node.p_W - near_far_W[i]).normalized();
  }
  if (sum.squaredNorm() > 0.0) end.direction = sum.normalized();
  return end;
}

// Whether f leads from this end into the segment.
bool ForceShading::leadsOn(Tick& tick, ActiveSegment& segment, bool from_parent) noexcept {
  const Shaded end = shade(tick, segment, from_parent);
  const double f = (tick.h_W - (from_parent ? segment.parent : segment.child).p_W).dot(end.direction);
  return from_parent ? f < 0.0 : f > 0.0;
}

// Moves the walk to the nearest other segment at this end. Returns false if f does not lead into that segment; a
// segment of length zero is always entered.
bool ForceShading::leave(Tick& tick, const Shaded& end, Walk& walk) noexcept {
  if (end.node == WorkingGraph::kNone || end.nearest == WorkingGraph::kNone) return false;
  graph_.open(end.node);
  const WorkingGraph::Edge& edge = graph_.edge(end.node, end.nearest);
  const bool from_parent = !edge.from_child;
  ActiveSegment next;
  next.become(graph_, end.node, edge);
  if (next.length2 != 0.0 && !leadsOn(tick, next, from_parent)) return false;
  walk = {next, from_parent ? 1.0 : 0.0};
  return true;
}

// Crosses a segment of length zero: leaves by the end from which it was not entered, else by the other end.
bool ForceShading::pass(Tick& tick, Walk& walk) noexcept {
  const bool from_parent = walk.t == 1.0;
  Walk entered = walk;
  if (leave(tick, shade(tick, entered.segment, !from_parent), walk)) return true;
  return leave(tick, shade(tick, entered.segment, from_parent), walk);
}

}  // namespace

std::unique_ptr<ProxySolver> makeForceShading(const SolverParameters& parameters) {
  return std::make_unique<ForceShading>(parameters);
}

}  // namespace filiform
