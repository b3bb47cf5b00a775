#include "solver/proxy/bounded_climb.h"

#include "index/geometry/closest_point.h"
#include "solver/graph/graph_view.h"
#include "solver/graph/internal/working_graph.h"
#include "solver/proxy/internal/active_segment.h"
#include "solver/proxy/internal/hub_branches.h"
#include "solver/proxy/internal/offer_heap.h"

#include <algorithm>
#include <cmath>

namespace filiform {

namespace {

using internal::WorkingGraph;

constexpr double kForget_s = 0.2;            // time in which patience falls to zero when the hand stops pulling
constexpr std::uint32_t kPassedInUnit = 16;  // segments that follow() passes in the time of two other tests

class BoundedClimb final : public ProxySolver {
 public:
  explicit BoundedClimb(const SolverParameters& parameters)
      : max_visited_(parameters.max_visited),
        climb_(parameters.climb),
        graph_(parameters.pool_nodes, max_visited_ + 2, 0),
        offers_(max_visited_ + 3) {}

  const ProxyPlace& place() const noexcept override { return state_.place; }
  void setPlace(const ProxyPlace& place) noexcept override {
    state_ = State{};
    state_.place = place;
    state_.last_W = place.p_W;
    before_ = state_;
    active_ = internal::ActiveSegment{};
    graph_.forget();
  }
  void advance(const GraphView& graph, const ProbeState& probe, SolverStep& step) noexcept override;
  void undo() noexcept override { state_ = before_; }
  void prepare(const GraphView& graph, const Vector3d& ahead_W, std::uint32_t most) noexcept override {
    active_.prepare(graph_, graph, state_.place, ahead_W, most);
  }
  bool wantsAnchor() const noexcept override { return true; }

 private:
  struct State {
    ProxyPlace place;
    double patience_mm = 0;                   // m
    Vector3d last_W = Vector3d::Zero();       // p at the last growth of the patience
    NodeId cut_node{UINT32_MAX, UINT32_MAX};  // the last node whose list of branches was cut by max_visited
    std::uint32_t cut_next = 0;               // the first branch that was not tested
    internal::HubBranches hub;
    bool looked = false;  // at the hub's branches, the last time that the search came to it
  };
  struct Best {  // on edge `edge` of node `node`; kNone: on the active segment
    bool improved = false;
    std::uint32_t node = WorkingGraph::kNone, edge = 0;
    double t = 0;
    Vector3d p_W = Vector3d::Zero();
    double yields_below = 0;  // squared distance that a better point must undercut, um^2
  };

  void wait(const ProbeState& probe, double distance_um) noexcept;
  void search(const ProbeState& probe, SolverStep& step) noexcept;
  void offer(std::uint32_t n, double cost, std::uint32_t by_rank) noexcept;
  void follow(const Vector3d& h_W, std::uint32_t n, WorkingGraph::Edge& edge, double cost, SolverStep& step) noexcept;
  bool expand(const Vector3d& h_W, std::uint32_t n, SolverStep& step) noexcept;
  bool test(const Vector3d& h_W, std::uint32_t n, std::uint32_t at, SolverStep& step) noexcept;
  void settle() noexcept;

  // The squared distance that a point must undercut to count as progress.
  static double yieldsBelow(double squared_distance) noexcept {
    const double distance = std::sqrt(squared_distance);
    const double bound = distance - std::max(1e-9, 1e-12 * distance);
    return bound > 0 ? bound * bound : 0.0;
  }

  std::uint32_t max_visited_;
  ClimbParameters climb_;
  State state_, before_;
  WorkingGraph graph_;
  internal::ActiveSegment active_;
  // Of the current search only.
  internal::OfferHeap offers_;
  double budget_um_ = 0;
  std::uint32_t passed_ = 0;                 // by follow()
  std::uint32_t hub_ = WorkingGraph::kNone;  // the first hub of the search
  Best best_;
};

[[gnu::flatten]] void BoundedClimb::advance(const GraphView& graph, const ProbeState& probe,
                                            SolverStep& step) noexcept {
  step.clear();
  before_ = state_;
  if (!state_.place.valid()) return;
  graph_.begin(graph);
  search(probe, step);
}

// Updates the patience: it grows while the hand pulls without progress.
void BoundedClimb::wait(const ProbeState& probe, double distance_um) noexcept {
  const double dt_s = probe.dt_s > 0 && std::isfinite(probe.dt_s) ? probe.dt_s : 0.0;
  const double pull_mm = 1e3 * (distance_um / probe.scale_um_m);
  const double moved_mm = 1e3 * ((state_.place.p_W - state_.last_W).norm() / probe.scale_um_m);
  state_.last_W = state_.place.p_W;
  double& m = state_.patience_mm;
  m = std::max(0.0, m - climb_.motion_cost * (1 + climb_.growth_1_mm * m) * moved_mm);
  if (pull_mm > climb_.pull_mm)
    m += climb_.patience_1_s * (1 + climb_.growth_1_mm * m) * std::min(pull_mm - climb_.pull_mm, climb_.most_pull_mm) *
         dt_s;
  else
    m *= std::max(0.0, 1.0 - dt_s / kForget_s);
  m = std::min(m, climb_.most_mm);
}

void BoundedClimb::search(const ProbeState& probe, SolverStep& step) noexcept {
  const Vector3d& h_W = probe.h_W;
  const double d2 = (state_.place.p_W - h_W).squaredNorm();
  if (!internal::usableDistance(d2) || !active_.moveTo(graph_.view(), state_.place, step)) return;
  const bool scaled = probe.scale_um_m > 0 && std::isfinite(probe.scale_um_m);
  if (scaled) wait(probe, std::sqrt(d2));

  ++step.visited;
  const ClosestPoint q = active_.closestTo(h_W);
  const bool nearer = q.squared_distance < d2;
  best_ = Best{};
  if (nearer) best_ = {true, WorkingGraph::kNone, 0, q.t, q.p_W, 0};
  const double best2 = nearer ? q.squared_distance : d2;
  best_.yields_below = yieldsBelow(best2);

  budget_um_ = 0;
  if (scaled) {
    const double pull_mm = 1e3 * (std::sqrt(best2) / probe.scale_um_m);
    const double budget_mm = std::min(climb_.most_mm, climb_.rest_mm + climb_.gain * pull_mm + state_.patience_mm);
    budget_um_ = 1e-3 * probe.leap * budget_mm * probe.scale_um_m;
  }

  graph_.newSearch();
  offers_.clear();
  passed_ = 0;
  hub_ = WorkingGraph::kNone;
  const double length = std::sqrt(active_.length2);
  const double to_child = length * std::min(q.t, state_.place.t);
  const double to_parent = length * (1.0 - std::max(q.t, state_.place.t));
  const std::uint32_t rank = active_.id.segment;
  if (to_child <= budget_um_) offer(active_.meet(graph_, active_.child), to_child, rank);
  if (to_parent <= budget_um_) offer(active_.meet(graph_, active_.parent), to_parent, rank);
  while (!offers_.empty()) {
    const std::uint32_t n = offers_.pop().node;
    if (graph_.node(n).label.progress != WorkingGraph::Progress::met) continue;
    if (!expand(h_W, n, step)) break;
  }
  if (!step.capped) state_.cut_node = NodeId{UINT32_MAX, UINT32_MAX};
  settle();
}

// At most one offer for each tested segment, and one for the other end of the first segment: they fit the heap.
// `by_rank`: the segment by which the search came.
void BoundedClimb::offer(std::uint32_t n, double cost, std::uint32_t by_rank) noexcept {
  const bool is_new = !graph_.isLabelled(n);
  WorkingGraph::Label& label = graph_.label(n);
  if (!is_new && !(cost < label.cost)) return;
  label.cost = cost;
  label.passed = by_rank;
  label.has_passed = true;
  graph_.prefetch(n);
  offers_.push({cost, graph_.node(n).id.key(), n});
}

// Goes on from the far end of a tested edge, at `cost`, as long as exactly two segments meet, and the next segment
// holds no better point. Offers the node where this ends, unless the budget ends before. The nodes between need no
// labels: in a cell with loops, their segments may be tested again, and then hold no better point either.
void BoundedClimb::follow(const Vector3d& h_W, std::uint32_t n, WorkingGraph::Edge& edge, double cost,
                          SolverStep& step) noexcept {
  const WorkingGraph::Node& node = graph_.node(n);
  const Tile& tile = *node.tile;
  const std::uint32_t by = edge.from_child ? UINT32_MAX : 1;  // modulo 2^32
  std::uint32_t at = edge.far, passed = 0;
  Vector3d p_W = edge.far_W;
  bool at_home = tile.isHome(at);
  while (at_home && tile.isBetween(at) && edge.rank + by * (passed + 1) != active_.id.segment &&
         step.visited < max_visited_) {
    const Vector3d next_W = tile.position_W(at + by), d_W = edge.from_child ? next_W - p_W : p_W - next_W;
    const double length2 = d_W.squaredNorm();
    const ClosestPoint w =
        edge.from_child ? closestPoint(p_W, next_W, d_W, length2, h_W) : closestPoint(next_W, p_W, d_W, length2, h_W);
    if (w.squared_distance < best_.yields_below) break;
    if (w.t == edge.nearT())
      cost += std::sqrt(length2);
    else if (w.t != edge.farT())
      cost += (next_W - w.p_W).norm();
    step.visited += ++passed_ % kPassedInUnit == 0;
    if (!(cost <= budget_um_)) return;
    ++passed;
    at += by;
    p_W = next_W;
    at_home = tile.isHome(at);
  }
  const std::uint32_t rank = edge.rank + by * passed;
  if (passed == 0) return offer(graph_.meetFar(n, edge), cost, rank);
  const NodeId id{node.id.cell, edge.far_rank + by * passed};
  offer(graph_.meet({id, p_W, at_home ? node.home : kNoTile, at_home ? at : WorkingGraph::kNone}), cost, rank);
}

// Tests the segments at a node and follows them. Returns false at the cap. At a hub, every second tick tests only the
// branches that point to the hand.
bool BoundedClimb::expand(const Vector3d& h_W, std::uint32_t n, SolverStep& step) noexcept {
  const WorkingGraph::Presence presence = graph_.open(n);
  const WorkingGraph::Node& node = graph_.node(n);
  if (presence != WorkingGraph::Presence::present) {
    graph_.label(n).progress = WorkingGraph::Progress::absent;
    ++step.frontiers;
    if (presence == WorkingGraph::Presence::absent) step.absent.add(node.home);
    return true;
  }
  step.touched.add(node.home);
  const std::uint32_t left = max_visited_ - step.visited;
  if (hub_ == WorkingGraph::kNone && node.degree > WorkingGraph::kMostEdges && node.degree > left / 2) {
    hub_ = n;
    state_.looked = !state_.looked;
    if (state_.looked) {
      const std::uint32_t most = internal::HubBranches::kLooksInTest * (left / 2);
      step.visited = std::min(max_visited_, step.visited + state_.hub.look(node, h_W, most));
      for (const std::uint32_t at : state_.hub.best())
        if (!test(h_W, n, at, step)) return false;
      step.capped = true;
      return true;
    }
  }
  graph_.label(n).progress = WorkingGraph::Progress::entered;
  std::uint32_t at = node.id == state_.cut_node && state_.cut_next < node.degree ? state_.cut_next : 0;
  for (std::uint32_t i = 0; i < node.degree; ++i, at = at + 1 == node.degree ? 0 : at + 1) {
    if (test(h_W, n, at, step)) continue;
    state_.cut_node = node.id;
    state_.cut_next = at;
    return false;
  }
  return true;
}

// Tests a segment at an open node and follows it. Returns false at the cap. Labels on nodes are enough: a segment has
// been tested exactly if one of its ends was entered, if the search came by it, or if it is the first one.
bool BoundedClimb::test(const Vector3d& h_W, std::uint32_t n, std::uint32_t at, SolverStep& step) noexcept {
  const WorkingGraph::Node& node = graph_.node(n);
  WorkingGraph::Edge& edge = graph_.edge(n, at);
  if (edge.rank == node.label.passed || edge.rank == active_.id.segment) return true;  // a search never leaves its cell
  const std::uint32_t far = graph_.findFar(n, edge);
  if (far != WorkingGraph::kNone && far != n && graph_.isLabelled(far) &&
      graph_.node(far).label.progress == WorkingGraph::Progress::entered)
    return true;
  if (step.visited == max_visited_) {
    step.capped = true;
    return false;
  }
  step.visited += n == hub_ && step.visited + 1 < max_visited_ ? 2 : 1;
  const ClosestPoint w = edge.closestTo(node.p_W, h_W);
  if (w.squared_distance < best_.yields_below) best_ = {true, n, at, w.t, w.p_W, yieldsBelow(w.squared_distance)};
  const double rise = w.t == edge.nearT() ? edge.length : w.t == edge.farT() ? 0.0 : (edge.far_W - w.p_W).norm();
  const double cost = node.label.cost + rise;
  if (cost <= budget_um_) follow(h_W, n, edge, cost, step);
  return true;
}

void BoundedClimb::settle() noexcept {
  if (!best_.improved) return;
  if (best_.node != WorkingGraph::kNone) {
    graph_.open(best_.node);
    active_.become(graph_, best_.node, graph_.edge(best_.node, best_.edge));
  } else if (!state_.place.at_node && best_.t != 0.0 && best_.t != 1.0) {  // the proxy slides along its segment
    state_.place.t = best_.t;
    state_.place.p_W = best_.p_W;
    return;
  }
  state_.place = active_.place(graph_.view(), best_.t, best_.p_W);
}

}  // namespace

std::unique_ptr<ProxySolver> makeBoundedClimb(const SolverParameters& parameters) {
  return std::make_unique<BoundedClimb>(parameters);
}

}  // namespace filiform
