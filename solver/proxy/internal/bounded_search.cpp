#include "solver/proxy/internal/bounded_search.h"

#include <algorithm>
#include <limits>

namespace filiform::internal {

namespace {

const Vector3d kNoSubGoal = Vector3d::Constant(std::numeric_limits<double>::infinity());

std::uint32_t labelsFor(std::uint32_t max_visited) noexcept {
  return std::max(BoundedSearch::kLeastLabels, 2 * max_visited);
}

}  // namespace

BoundedSearch::BoundedSearch(std::uint32_t max_visited, std::uint32_t pool_nodes, const Reach& reach)
    : max_visited_(max_visited),
      max_scans_(kScansPerTest * max_visited),
      reach_(reach),
      graph_(pool_nodes, labelsFor(max_visited), max_visited + 4),
      stack_(labelsFor(max_visited) + 4),
      changes_(max_scans_ + 2 * max_visited + 8),
      touched_(std::min<std::size_t>(stack_.size(), max_scans_ + 2)) {}

void BoundedSearch::setPlace(const ProxyPlace& place) noexcept {
  restart(place);
  active_ = ActiveSegment{};
  graph_.forget();
}

[[gnu::flatten]] void BoundedSearch::advance(const GraphView& graph, const ProbeState& probe,
                                             SolverStep& step) noexcept {
  step.clear();
  undo_ = Undo::nothing;
  const double distance2 = (state_.place.p_W - probe.h_W).squaredNorm();
  if (!usableDistance(distance2) || !state_.place.valid()) return;
  graph_.begin(graph);
  Tick tick{probe.h_W, step};
  tick.best.squared_distance = distance2;
  resumed_ = state_.depth > 0;
  undo_ = resumed_ ? Undo::all : Undo::sweep;
  keeps_place_ = false;
  if (resumed_) resume(tick);
  const bool begins = state_.depth == 0 && !step.capped && step.visited < max_visited_ && (!resumed_ || state_.moved);
  if (begins) sweep(tick, resumed_);
  state_.h_W = probe.h_W;
}

[[gnu::noinline]] void BoundedSearch::resume(Tick& tick) noexcept {
  before_ = state_;
  search_before_ = graph_.search();
  changed_ = 0;
  untouched_ = state_.depth;
  if (state_.h_W != tick.h_W) {
    state_.moved = true;
    if (max_visited_ > 1) slide(tick);  // it takes a test: with one test a tick the sweep would never end
  }
  run(tick);
  settle(tick);
}

void BoundedSearch::sweep(Tick& tick, bool beside) noexcept {
  graph_.newSearch(beside);
  state_.moved = false;
  state_.starts_on_segment = !state_.place.at_node;
  if (state_.starts_on_segment)
    testActive(tick);
  else
    push(active_.meetNode(graph_, state_.place), kNoSubGoal);
  run(tick);
  settle(tick);
}

// Tests the active segment again; at a node, the segment from which the proxy came. Does not enter its ends: the next
// sweep does that, so that the bound on the stack holds.
void BoundedSearch::slide(Tick& tick) noexcept {
  if (!active_.moveTo(graph_.view(), state_.place, tick.step)) return;
  ++tick.step.visited;
  offer(tick, active_.closestTo(tick.h_W), WorkingGraph::kNone, 0);
}

void BoundedSearch::testActive(Tick& tick) noexcept {
  if (!active_.moveTo(graph_.view(), state_.place, tick.step)) return;
  ++tick.step.visited;
  state_.first = active_.id.segment;
  const ClosestPoint q = active_.closestTo(tick.h_W);
  offer(tick, q, WorkingGraph::kNone, 0);
  if (active_.length2 == 0.0) {  // both ends are equally near
    push(active_.meet(graph_, active_.parent), kNoSubGoal);
    push(active_.meet(graph_, active_.child), kNoSubGoal);
    return;
  }
  constexpr double kUnbounded = std::numeric_limits<double>::infinity();
  visitEnds(reach_, active_.child.p_W, active_.parent.p_W, q, reach_.bound2(kUnbounded, tick.best.squared_distance),
            [&](bool at_parent) { push(active_.meet(graph_, at_parent ? active_.parent : active_.child), q.p_W); });
}

void BoundedSearch::run(Tick& tick) noexcept {
  while (state_.depth > 0) {
    if (tick.step.visited == max_visited_ || tick.scans >= max_scans_) {
      tick.step.capped = true;
      return;
    }
    if (graph_.full()) return giveUp(tick);
    ++tick.scans;
    Entry& top = touchTop();
    if (!enter(tick, top)) {
      --state_.depth;
      continue;
    }
    const std::uint32_t n = top.node, degree = graph_.node(n).degree;
    WorkingGraph::Edge* edge = nullptr;
    bool fresh = false;
    while (!fresh && top.next < degree && tick.scans <= max_scans_) {
      edge = &graph_.edge(n, top.next++);
      ++tick.scans;
      fresh = !isTested(n, *edge);
    }
    WorkingGraph::Label& label = this->label(n);
    label.passed = edge->rank;
    label.has_passed = true;
    // An entry without further edges is popped before its last branch is searched (a tail call), so that the stack
    // stays short on long neurites.
    const std::uint32_t i = top.next - 1;
    const Vector3d sub_goal_W = top.sub_goal_W;
    if (top.next == degree) --state_.depth;
    if (fresh) test(tick, n, i, *edge, sub_goal_W);
  }
}

// Returns false if the node has no edges left to test, or if its tile is absent.
bool BoundedSearch::enter(Tick& tick, Entry& top) noexcept {
  if (!top.entered) {
    if (graph_.node(top.node).label.progress == WorkingGraph::Progress::entered) return false;
    label(top.node).progress = WorkingGraph::Progress::entered;
    top.entered = true;
  }
  const WorkingGraph::Presence presence = graph_.open(top.node);
  const WorkingGraph::Node& node = graph_.node(top.node);
  if (presence != WorkingGraph::Presence::present) {
    ++tick.step.frontiers;
    if (presence == WorkingGraph::Presence::absent) tick.step.absent.add(node.home);
    return false;
  }
  tick.step.touched.add(node.home);
  return top.next < node.degree;
}

bool BoundedSearch::isTested(std::uint32_t n, const WorkingGraph::Edge& edge) const noexcept {
  if (state_.starts_on_segment && edge.rank == state_.first) return true;
  const std::uint32_t far = graph_.findFar(n, edge);
  if (far == WorkingGraph::kNone || !graph_.isLabelled(far)) return false;
  const WorkingGraph::Label& label = graph_.node(far).label;
  return label.has_passed && label.passed >= edge.rank;
}

void BoundedSearch::test(Tick& tick, std::uint32_t n, std::uint32_t i, WorkingGraph::Edge& edge,
                         const Vector3d& sub_goal_W) noexcept {
  ++tick.step.visited;
  const Vector3d& node_W = graph_.node(n).p_W;
  const ClosestPoint q = edge.closestTo(node_W, tick.h_W);
  offer(tick, q, n, i);
  if (edge.length2 == 0.0) return push(graph_.meetFar(n, edge), sub_goal_W);
  // Measured to the current h, even if the sweep began under another h.
  const double bound2 = reach_.bound2((sub_goal_W - tick.h_W).squaredNorm(), tick.best.squared_distance);
  const Vector3d &child_W = edge.from_child ? node_W : edge.far_W, &parent_W = edge.from_child ? edge.far_W : node_W;
  visitEnds(reach_, child_W, parent_W, q, bound2, [&](bool at_parent) {
    if (at_parent == edge.from_child) push(graph_.meetFar(n, edge), q.p_W);  // not the end from which it was entered
  });
}

void BoundedSearch::offer(Tick& tick, const ClosestPoint& q, std::uint32_t node, std::uint32_t edge) const noexcept {
  if (!(q.squared_distance < tick.best.squared_distance)) return;
  tick.improved = true;
  tick.best = q;
  tick.node = node;
  tick.edge = edge;
}

void BoundedSearch::push(std::uint32_t n, const Vector3d& sub_goal_W) noexcept {
  if (label(n).progress == WorkingGraph::Progress::met) stack_[state_.depth++] = {n, 0, false, sub_goal_W};
}

void BoundedSearch::settle(Tick& tick) noexcept {
  if (!tick.improved) return;
  tick.improved = false;
  ProxyPlace& place = state_.place;
  if (undo_ == Undo::sweep && !keeps_place_) {
    keeps_place_ = true;
    before_.place = place;
  }
  const ClosestPoint& q = tick.best;
  const bool inside = q.t != 0.0 && q.t != 1.0;
  if (tick.node != WorkingGraph::kNone) {
    graph_.open(tick.node);
    active_.become(graph_, tick.node, graph_.edge(tick.node, tick.edge));
  } else if (inside && !place.at_node) {  // the proxy slides along its segment
    place.t = q.t;
    place.p_W = q.p_W;
    return;
  }
  place = active_.place(graph_.view(), q.t, q.p_W);
}

WorkingGraph::Label& BoundedSearch::label(std::uint32_t n) noexcept {
  if (resumed_) changes_[changed_++] = {n, graph_.node(n).label};
  return graph_.label(n);
}

BoundedSearch::Entry& BoundedSearch::touchTop() noexcept {
  const std::uint32_t top = state_.depth - 1;
  if (resumed_ && top < untouched_) {
    touched_[before_.depth - 1 - top] = stack_[top];
    untouched_ = top;
  }
  return stack_[top];
}

void BoundedSearch::giveUp(Tick& tick) noexcept {
  // Leaves the stack entries in place, because undo() needs them.
  state_.depth = 0;
  tick.step.capped = true;
}

void BoundedSearch::undo() noexcept {
  if (undo_ == Undo::all) {
    for (std::uint32_t i = untouched_; i < before_.depth; ++i) stack_[i] = touched_[before_.depth - 1 - i];
    while (changed_ > 0) {
      --changed_;
      graph_.restore(changes_[changed_].node, changes_[changed_].before);
    }
    graph_.resume(search_before_);
    state_ = before_;
  } else if (undo_ == Undo::sweep) {
    if (keeps_place_) state_.place = before_.place;
    state_.depth = 0;
  }
  undo_ = Undo::nothing;
}

void BoundedSearch::prepare(const GraphView& graph, const Vector3d& ahead_W, std::uint32_t most) noexcept {
  if (state_.depth == 0) active_.prepare(graph_, graph, state_.place, ahead_W, most);
}

}  // namespace filiform::internal
