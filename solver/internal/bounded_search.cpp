#include "solver/internal/bounded_search.h"

#include "solver/internal/active_segment.h"

#include <algorithm>
#include <limits>

namespace filiform::internal {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
const Vector3d kNoSubGoal = Vector3d::Constant(kInfinity);
constexpr std::uint32_t kAhead = 4;    // branches of a hub whose marks are fetched in time
constexpr std::uint32_t kStars = 256;  // of the proxy's neighbourhood; more than a quick sweep enters

std::uint32_t marksFor(std::uint32_t max_visited) noexcept {
  return std::max(BoundedSearch::kLeastMarks, 3 * max_visited);
}

// Eigen's own assignment is a call in so large a function.
[[gnu::always_inline]] inline void assign(Vector3d& to, const Vector3d& from) noexcept {
  to.x() = from.x();
  to.y() = from.y();
  to.z() = from.z();
}

}  // namespace

BoundedSearch::BoundedSearch(std::uint32_t max_visited, const Reach& reach)
    : max_visited_(max_visited),
      max_scans_(kScansPerTest * max_visited),
      reach_(reach),
      stars_(kStars),
      marks_(marksFor(max_visited), max_visited + max_scans_ + 2),
      stack_(marksFor(max_visited) + 2),
      kept_(std::min<std::size_t>(stack_.size(), max_scans_ + 2)) {}

void BoundedSearch::setPlace(const ProxyPlace& place) noexcept {
  state_ = State{};
  state_.place = place;
  active_ = ActiveSegment{};
  stars_.forget();
  undo_ = Undo::nothing;
}

void BoundedSearch::keepForUndo() noexcept {
  before_ = state_;
  kept_above_ = state_.depth;
  marks_.beginTick();
  undo_ = Undo::all;
}

// The usual tick: from the active segment nothing leads on, or no farther than the branches at its ends. `old2` is the
// squared distance of the place. False: it does, or there is something to be careful about, and nothing has happened.
[[gnu::always_inline]] inline bool BoundedSearch::shallowSweep(const GraphView& graph, const Vector3d& h_W, double old2,
                                                               SolverStep& step) noexcept {
  const ActiveSegment& active = active_;
  // The star of one end would take the place of the other's.
  if (active.length2 == 0.0 || stars_.collide(active.child_id, active.parent_id)) return false;
  const ClosestPoint q = active.closestTo(h_W);
  std::uint32_t visited = 1;
  double best2 = std::min(old2, q.squared_distance);
  bool leads_on[2] = {false, false};  // by the child, by the parent
  follow(reach_, active.child_W, active.parent_W, q, reach_.bound2(kInfinity, best2),
         [&leads_on](bool at_parent) { leads_on[at_parent] = true; });
  const StarCache::Star* best_star = nullptr;
  const StarCache::Ray* best_ray = nullptr;
  double best_t = 0;
  Vector3d best_W = q.p_W;
  for (int end = leads_on[0] ? 0 : 1; end <= (leads_on[1] ? 1 : 0); ++end) {
    const StarCache::Star* star = stars_.find(graph, end == 0 ? active.child_id : active.parent_id, *active.tile,
                                              end == 0 ? active.child : active.parent);
    if (star == nullptr || !star->plain || visited + star->degree > max_visited_) return false;
    if (star->tile != active.tile) step.touched.add(star->home);
    // The nearest point of most branches is the node itself. It is no nearer than the best point yet, and the branch
    // ends there; by the listing only where it is farther.
    const Vector3d x_W = h_W - star->p_W;
    const double x2 = x_W.squaredNorm();
    if (x2 < best2 || (reach_.escape == Escape::listing && x2 == best2)) return false;
    for (std::uint32_t i = 0; i < star->degree; ++i) {
      const StarCache::Ray& ray = star->rays[i];
      if (ray.rank == active.id.segment) continue;
      ++visited;
      const Vector3d &child_W = ray.from_child ? star->p_W : ray.far_W,
                     &parent_W = ray.from_child ? ray.far_W : star->p_W;
      const Vector3d d_W = parent_W - child_W;
      if (ray.from_child ? !(x_W.dot(d_W) > 0.0) : (h_W - child_W).dot(d_W) >= d_W.squaredNorm()) continue;
      const ClosestPoint w = closestPoint(child_W, parent_W, h_W);
      bool goes_on = false;
      follow(reach_, child_W, parent_W, w, reach_.bound2(q.squared_distance, best2),
             [&](bool at_parent) { goes_on = goes_on || at_parent == ray.from_child; });
      if (goes_on) return false;
      if (!(w.squared_distance < best2)) continue;
      if (w.t == 0.0 || w.t == 1.0) return false;
      best2 = w.squared_distance;
      best_t = w.t;
      best_W = w.p_W;
      best_star = star;
      best_ray = &ray;
    }
  }
  step.visited = visited;
  if (best_ray != nullptr) {
    keepForUndo();
    state_.place.segment = {best_star->id.cell, best_ray->rank};
    state_.place.t = best_t;
    state_.place.p_W = best_W;
    state_.place.tile = best_star->home;
    state_.segment = best_ray->segment;
    state_.home = kNoTile;
    active_.become(*best_star, *best_ray);
  } else if (q.squared_distance < old2) {
    if (q.t != 0.0 && q.t != 1.0) {  // it slides along its segment: nothing else changes
      undo_ = Undo::slide;
      before_.place.t = state_.place.t;
      assign(before_.place.p_W, state_.place.p_W);
      state_.place.t = q.t;
      assign(state_.place.p_W, q.p_W);
    } else {
      keepForUndo();
      settle(graph, *active.tile, active.segment, q.t, q.p_W);
    }
  }
  return true;
}

void BoundedSearch::advance(const GraphView& graph, const ProbeState& probe, SolverStep& step) noexcept {
  const Vector3d& h_W = probe.h_W;
  ProxyPlace& place = state_.place;
  clear(step);
  undo_ = Undo::nothing;
  const double distance2 = (place.p_W - h_W).squaredNorm();
  if (!usableDistance(distance2) || !place.valid()) return;

  const bool on_segment = state_.depth == 0 && !place.at_node && active_.follow(graph, place, state_.segment, step);
  if (on_segment && shallowSweep(graph, h_W, distance2, step)) return;
  deepSweep(graph, h_W, on_segment, distance2, step);
}

// All others. `on_segment`: the place is inside the active segment.
[[gnu::noinline]] void BoundedSearch::deepSweep(const GraphView& graph, const Vector3d& h_W, bool on_segment,
                                                double old2, SolverStep& step) noexcept {
  Tick tick{graph, h_W, step, 0, {}};
  tick.best.squared_distance = old2;
  if (state_.depth == 0 && quickSweep(tick, on_segment)) {
    if (tick.best.tile == nullptr) return;
    keepForUndo();
    return settle(tick);
  }
  keepForUndo();
  sweep(tick);
}

void BoundedSearch::sweep(Tick& tick) noexcept {
  const bool resumes = state_.depth > 0;
  if (resumes) {
    if (state_.h_W != tick.h_W) {
      state_.moved = true;
      if (max_visited_ > 1) slide(tick);  // with a single test a tick the sweep would never end
    }
    run(tick);
  }
  settle(tick);
  if (state_.depth == 0 && !tick.step.capped && (!resumes || state_.moved) && tick.step.visited < max_visited_) {
    state_.moved = false;
    startSweep(tick);
    run(tick);
    settle(tick);
  }
  state_.h_W = tick.h_W;
}

void BoundedSearch::undo() noexcept {
  const Undo undo = undo_;
  undo_ = Undo::nothing;
  if (undo == Undo::slide) {
    state_.place.t = before_.place.t;
    state_.place.p_W = before_.place.p_W;
  }
  if (undo != Undo::all) return;
  state_ = before_;
  for (std::uint32_t i = kept_above_; i < state_.depth; ++i) stack_[i] = kept_[state_.depth - 1 - i];
  marks_.undo();
}

void BoundedSearch::settle(Tick& tick) noexcept {
  if (tick.best.tile == nullptr) return;
  settle(tick.graph, *tick.best.tile, tick.best.segment, tick.best.t, tick.best.p_W);
  tick.best.tile = nullptr;
}

void BoundedSearch::settle(const GraphView& graph, const Tile& tile, std::uint32_t segment, double t,
                           const Vector3d& p_W) noexcept {
  state_.place = graph.placeOn(tile, segment, t, p_W);
  state_.segment = segment;
  state_.home = kNoTile;
  if (state_.place.at_node && state_.place.tile == tile.id()) {
    state_.home = tile.id();
    state_.node = t == 0.0 ? tile.child(segment) : tile.parent(segment);
  }
}

// Home of the place's node: its place is its grid point exactly, so its home follows from it.
void BoundedSearch::findHome(const GraphView& graph) noexcept {
  const ProxyPlace& place = state_.place;
  const Tile* known = graph.tiles().find(state_.home);
  if (known != nullptr && state_.node < known->node_count() && known->nodeId(state_.node) == place.node) return;
  const GraphView::HomeNode home = graph.home(place.node, graph.grid().snap(place.p_W));
  state_.home = home.home;
  state_.node = home.present() ? home.node : kNoNode;
}

// False: nothing has happened, the sweep is too large or meets an absent tile.
bool BoundedSearch::quickSweep(Tick& tick, bool on_segment) noexcept {
  const double old2 = tick.best.squared_distance;
  const ProxyPlace& place = state_.place;
  bool done = false;
  if (!place.at_node) {
    clear(tick.step);
    tick.step.touched.add(place.tile);
    done = on_segment &&
           quick_.fromSegment(tick.graph, stars_, reach_, active_, tick.h_W, max_visited_, tick.step, tick.best);
  } else if (const StarCache::Star* star = stars_.kept(tick.graph, place.node)) {
    done = quick_.fromNode(tick.graph, stars_, reach_, place.node, *star->tile, star->node, tick.h_W, max_visited_,
                           tick.step, tick.best);
  } else {
    findHome(tick.graph);
    const Tile* home = tick.graph.tiles().find(state_.home);
    done = home != nullptr && state_.node != kNoNode &&
           quick_.fromNode(tick.graph, stars_, reach_, place.node, *home, state_.node, tick.h_W, max_visited_,
                           tick.step, tick.best);
  }
  if (done) return true;
  tick.best = BestPoint{};
  tick.best.squared_distance = old2;
  clear(tick.step);
  return false;
}

void BoundedSearch::startSweep(Tick& tick) noexcept {
  marks_.newEpoch();
  const ProxyPlace& place = state_.place;
  if (place.at_node) {
    findHome(tick.graph);
    stack_[state_.depth++] = {
        place.node, state_.home, state_.node, 0, 0, kNoSubGoal, tick.graph.grid().snap(place.p_W)};
    return;
  }
  const GraphView::SegmentRef ref = active(tick);
  if (!ref) return;
  marks_.put(Marks::Kind::segment, place.segment.key());
  test(tick, *ref.tile, ref.segment, kNoSubGoal);
}

// At a node too: its place keeps the segment by which it was reached, the way back. Only offers: ends that it reaches
// are entered by the sweep that follows, so that the bound on the stack holds.
void BoundedSearch::slide(Tick& tick) noexcept {
  const GraphView::SegmentRef ref = active(tick);
  if (!ref) return;
  ++tick.step.visited;
  const Tile& tile = *ref.tile;
  tick.best.offer(
      tile, ref.segment,
      closestPoint(tile.position_W(tile.child(ref.segment)), tile.position_W(tile.parent(ref.segment)), tick.h_W));
}

GraphView::SegmentRef BoundedSearch::active(Tick& tick) noexcept {
  return activeSegment(tick.graph, state_.place, state_.segment, tick.step);
}

void BoundedSearch::run(Tick& tick) noexcept {
  while (state_.depth > 0) {
    if (tick.step.visited == max_visited_ || tick.scans >= max_scans_) {
      tick.step.capped = true;
      return;
    }
    ++tick.scans;
    Entry& top = touchTop();
    if (top.end == 0) {
      if (!enter(tick, top)) continue;
    }
    const Tile* tile = tick.graph.tiles().find(top.home);
    if (tile == nullptr) {  // let go since it was entered
      ++tick.step.frontiers;
      tick.step.absent.add(top.home);
      pop();
      continue;
    }
    tick.step.touched.add(top.home);

    const auto incident = tile->incident(top.node);
    std::uint32_t segment = 0;
    Marks::Put put = Marks::Put::present;
    while (put == Marks::Put::present && top.next < top.end && tick.scans <= max_scans_) {
      segment = incident[top.next++];
      ++tick.scans;
      put = marks_.put(Marks::Kind::segment, tile->segmentId(segment).key());
    }
    if (put == Marks::Put::full) return giveUp(tick);
    if (top.next + kAhead < top.end) marks_.prefetch(tile->segmentId(incident[top.next + kAhead]).key());
    // An entry that has nothing left goes before its last branch is followed, as a tail call: stacks stay short on long
    // threads.
    const Vector3d sub_goal_W = top.sub_goal_W;
    if (top.next == top.end) pop();
    if (put == Marks::Put::fresh) test(tick, *tile, segment, sub_goal_W);
  }
}

bool BoundedSearch::enter(Tick& tick, Entry& top) noexcept {
  const Marks::Put put = marks_.put(Marks::Kind::node, top.id.key());
  if (put == Marks::Put::full) {
    giveUp(tick);
    return false;
  }
  if (put == Marks::Put::fresh) {
    GraphView::HomeNode home;
    if (top.node == kNoNode) {
      if (top.home == kNoTile) top.home = tick.graph.leaves().home(top.point);
      home = tick.graph.nodeIn(top.home, top.id);
    } else {
      home = {top.home, tick.graph.tiles().find(top.home), top.node};
    }
    if (home.present()) {
      top.node = home.node;
      top.next = 0;
      top.end = static_cast<std::uint32_t>(home.tile->incident(home.node).size());
      if (top.end > 0) return true;
    } else {
      ++tick.step.frontiers;
      if (home.frontier()) tick.step.absent.add(home.home);
    }
  }
  pop();
  return false;
}

void BoundedSearch::test(Tick& tick, const Tile& tile, std::uint32_t segment, const Vector3d& sub_goal_W) noexcept {
  ++tick.step.visited;
  const Tile::Link link = tile.link(segment);
  const Vector3d child_W = tile.position_W(link.child), parent_W = tile.position_W(link.parent);
  const ClosestPoint q = closestPoint(child_W, parent_W, tick.h_W);
  tick.best.offer(tile, segment, q);
  if (child_W == parent_W) {  // which of the ends q is makes no difference: neither is nearer than the other
    goOn(tile, link.parent, link.parent_id, sub_goal_W);
    goOn(tile, link.child, link.child_id, sub_goal_W);
    return;
  }
  // The sub-goal is kept as a point: its distance is that to the present h even when the sweep began under another one.
  const double bound2 = reach_.bound2((sub_goal_W - tick.h_W).squaredNorm(), tick.best.squared_distance);
  follow(reach_, child_W, parent_W, q, bound2, [&](bool at_parent) {
    if (at_parent)
      goOn(tile, link.parent, link.parent_id, q.p_W);
    else
      goOn(tile, link.child, link.child_id, q.p_W);
  });
}

void BoundedSearch::goOn(const Tile& tile, std::uint32_t node, NodeId id, const Vector3d& sub_goal_W) noexcept {
  if (marks_.contains(Marks::Kind::node, id.key())) return;
  Entry& entry = stack_[state_.depth++];
  if (tile.isHome(node))
    entry = {id, tile.id(), node, 0, 0, sub_goal_W, GridPoint::Zero()};
  else
    entry = {id, kNoTile, kNoNode, 0, 0, sub_goal_W, tile.gridPoint(node)};
}

BoundedSearch::Entry& BoundedSearch::touchTop() noexcept {
  const std::uint32_t top = state_.depth - 1;
  if (top < kept_above_) {
    kept_[before_.depth - 1 - top] = stack_[top];
    kept_above_ = top;
  }
  return stack_[top];
}

void BoundedSearch::pop() noexcept { --state_.depth; }

void BoundedSearch::giveUp(Tick& tick) noexcept {
  // The entries below stay where they are: undo() needs them, and nothing else looks at them.
  state_.depth = 0;
  tick.step.capped = true;
}

}  // namespace filiform::internal
