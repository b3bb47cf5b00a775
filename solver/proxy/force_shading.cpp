#include "solver/proxy/force_shading.h"

#include "index/geometry/closest_point.h"
#include "solver/graph/graph_view.h"
#include "solver/graph/internal/working_graph.h"
#include "solver/proxy/internal/active_segment.h"
#include "solver/proxy/internal/bounded_search.h"

#include <algorithm>
#include <limits>

namespace filiform {

namespace {

constexpr double kUnbounded = std::numeric_limits<double>::infinity();
constexpr double kRests_um = 1e-9;

using internal::ActiveSegment;
using internal::WorkingGraph;

class ForceShading final : public ProxySolver {
 public:
  explicit ForceShading(const SolverParameters& parameters)
      : most_(parameters.max_visited),
        most_in_descent_(std::max(1U, parameters.max_visited / 2)),
        graph_(parameters.pool_nodes, 2 * kShadingPasses, 0),
        descent_(most_in_descent_, parameters.pool_nodes, internal::Reach{}) {}

  const ProxyPlace& place() const noexcept override { return place_; }
  void setPlace(const ProxyPlace& place) noexcept override {
    place_ = before_ = place;
    active_ = ActiveSegment{};
    graph_.forget();
    descent_.setPlace(place);
  }
  void advance(const GraphView& graph, const ProbeState& probe, SolverStep& step) noexcept override;
  void undo() noexcept override { place_ = before_; }
  void prepare(const GraphView& graph, const Vector3d& ahead_W, std::uint32_t most) noexcept override {
    active_.prepare(graph_, graph, place_, ahead_W, most / 2);
    descent_.restart(place_);
    descent_.prepare(graph, ahead_W, most / 2);
  }

 private:
  Vector3d direction(ActiveSegment::End& end, bool is_parent, const Vector3d& h_W, SolverStep& step) noexcept;
  Vector3d subGoal(const Vector3d& h_W, SolverStep& step) noexcept;
  void descend(const GraphView& graph, const Vector3d& goal_W, SolverStep& step) noexcept;

  std::uint32_t most_, most_in_descent_;
  ProxyPlace place_, before_;
  WorkingGraph graph_;
  ActiveSegment active_;
  internal::BoundedSearch descent_;
  // Of the current tick only.
  std::uint32_t looks_ = 0;
  SolverStep descended_;
};

void ForceShading::advance(const GraphView& graph, const ProbeState& probe, SolverStep& step) noexcept {
  step.clear();
  before_ = place_;
  if (!place_.valid() || !internal::usableDistance((place_.p_W - probe.h_W).squaredNorm())) return;
  graph_.begin(graph);
  graph_.newSearch();
  looks_ = 0;
  for (std::uint32_t pass = 0; pass < kShadingPasses; ++pass) {
    if (step.visited + most_in_descent_ > most_) {
      step.capped = true;
      return;
    }
    if (!active_.moveTo(graph, place_, step)) return;
    const Vector3d from_W = place_.p_W;
    descend(graph, subGoal(probe.h_W, step), step);
    if (step.absent.count > 0 || (place_.p_W - from_W).norm() <= kRests_um) return;
  }
}

Vector3d ForceShading::subGoal(const Vector3d& h_W, SolverStep& step) noexcept {
  const Vector3d at_child = direction(active_.child, false, h_W, step);
  const Vector3d along = (1 - place_.t) * at_child + place_.t * direction(active_.parent, true, h_W, step);
  if (!(active_.length2 > 0 && along.squaredNorm() > 0)) return h_W;
  const Vector3d unit = along.normalized();
  return place_.p_W + unit * unit.dot(h_W - place_.p_W);
}

void ForceShading::descend(const GraphView& graph, const Vector3d& goal_W, SolverStep& step) noexcept {
  descent_.restart(place_);
  descent_.advance(graph, {goal_W}, descended_);
  place_ = descent_.place();
  step.visited += descended_.visited;
  step.capped |= descended_.capped;
  step.frontiers += descended_.frontiers;
  for (std::uint32_t i = 0; i < descended_.touched.count; ++i) step.touched.add(descended_.touched.ids[i]);
  for (std::uint32_t i = 0; i < descended_.absent.count; ++i) step.absent.add(descended_.absent.ids[i]);
}

// The shaded direction at an end of the active segment, from child to parent.
Vector3d ForceShading::direction(ActiveSegment::End& end, bool is_parent, const Vector3d& h_W,
                                 SolverStep& step) noexcept {
  const Vector3d own = active_.d_W.normalized();
  const std::uint32_t n = active_.meet(graph_, end);
  static_cast<void>(graph_.label(n));
  const WorkingGraph::Presence presence = graph_.open(n);
  const WorkingGraph::Node& node = graph_.node(n);
  if (presence != WorkingGraph::Presence::present) {
    ++step.frontiers;
    if (presence == WorkingGraph::Presence::absent) step.absent.add(node.home);
    return own;
  }
  step.touched.add(node.home);
  double near2[2] = {kUnbounded, kUnbounded};  // the two nearest other segments, nearest first
  Vector3d far_W[2] = {node.p_W, node.p_W};
  for (std::uint32_t i = 0; i < node.degree; ++i) {
    const WorkingGraph::Edge& edge = graph_.edge(n, i);
    if (edge.rank == active_.id.segment || edge.length2 == 0.0) continue;
    if (looks_ == most_) {
      step.capped = true;
      break;
    }
    ++looks_;
    const double d2 = edge.closestTo(node.p_W, h_W).squared_distance;
    if (!(d2 < near2[1])) continue;
    const std::uint32_t at = d2 < near2[0] ? 0 : 1;
    if (at == 0) {
      near2[1] = near2[0];
      far_W[1] = far_W[0];
    }
    near2[at] = d2;
    far_W[at] = edge.far_W;
  }
  Vector3d sum = own;
  for (int i = 0; i < 2; ++i)
    if (near2[i] < kUnbounded) sum += (is_parent ? far_W[i] - node.p_W : node.p_W - far_W[i]).normalized();
  return sum.squaredNorm() > 0.0 ? Vector3d(sum.normalized()) : own;
}

}  // namespace

std::unique_ptr<ProxySolver> makeForceShading(const SolverParameters& parameters) {
  return std::make_unique<ForceShading>(parameters);
}

}  // namespace filiform
