#include "solver/bounded_climb.h"

#include "index/closest_point.h"
#include "solver/graph_view.h"
#include "solver/internal/active_segment.h"
#include "solver/internal/node_numbers.h"
#include "solver/internal/star_cache.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace filiform {

namespace {

using internal::NodeNumbers;

constexpr std::uint32_t kStars = 512;  // of the proxy's neighbourhood
constexpr double kForget_s = 0.2;      // in which patience goes when the hand lets up

class BoundedClimb final : public ProxySolver {
 public:
  explicit BoundedClimb(const SolverParameters& parameters)
      : max_visited_(parameters.max_visited),
        climb_(parameters.climb),
        stars_(kStars),
        numbers_(max_visited_ + 2),
        nodes_(max_visited_ + 2),
        heap_(max_visited_ + 2) {}

  const ProxyPlace& place() const noexcept override { return state_.place; }
  void setPlace(const ProxyPlace& place) noexcept override {
    state_ = State{};
    state_.place = place;
    state_.began_W = place.p_W;
    before_ = state_;
    active_ = internal::ActiveSegment{};
    stars_.forget();
  }
  void advance(const GraphView& graph, const ProbeState& probe, SolverStep& step) noexcept override;
  void undo() noexcept override { state_ = before_; }
  bool wantsAnchor() const noexcept override { return true; }

 private:
  struct State {
    ProxyPlace place;
    std::uint32_t segment = 0;                // the place's, where it was last in its tile
    double patience_mm = 0;                   // m
    Vector3d began_W = Vector3d::Zero();      // a
    NodeId cut_node{UINT32_MAX, UINT32_MAX};  // whose branches max_visited has cut last
    std::uint32_t cut_next = 0;               // the branch to go on with
  };
  enum class Progress : std::uint8_t { offered, done, absent };
  struct Node {
    double cost;  // um
    NodeId id;
    const Tile* tile;    // any that stores it
    std::uint32_t node;  // in `tile`
    Progress progress;
  };
  struct Offer {
    double cost;
    std::uint64_t key;  // of the node
    std::uint32_t number;
    // For a heap with the least on top.
    bool operator<(const Offer& other) const noexcept {
      return cost != other.cost ? cost > other.cost : key > other.key;
    }
  };
  struct Best {
    const Tile* tile = nullptr;  // nullptr: the old place
    std::uint32_t segment = 0;
    double t = 0;
    Vector3d p_W = Vector3d::Zero();
    double yields_below = 0;  // squared distance, um^2
  };

  void wait(const ProbeState& probe, double distance_um) noexcept;
  void search(const GraphView& graph, const ProbeState& probe, SolverStep& step) noexcept;
  void offer(NodeId id, const Tile& tile, std::uint32_t node, double cost) noexcept;
  bool follow(const GraphView& graph, const Vector3d& h_W, std::uint32_t number, SolverStep& step) noexcept;
  template <typename Branches>
  bool testBranches(const Tile& home, NodeId id, double cost, const Vector3d& h_W, SolverStep& step,
                    const Branches& branches) noexcept;
  void settle(const GraphView& graph) noexcept;

  // What a point must be nearer than to count as progress.
  static double yieldsBelow(double squared_distance) noexcept {
    const double distance = std::sqrt(squared_distance);
    const double bound = distance - std::max(1e-9, 1e-12 * distance);
    return bound > 0 ? bound * bound : 0.0;
  }

  std::uint32_t max_visited_;
  ClimbParameters climb_;
  State state_, before_;
  // Of the neighbourhood, decoded.
  internal::ActiveSegment active_;
  internal::StarCache stars_;
  // Of the present search only.
  NodeNumbers numbers_;
  std::vector<Node> nodes_;  // by number
  std::vector<Offer> heap_;
  std::size_t offers_ = 0;
  double budget_um_ = 0;
  Best best_;
};

void BoundedClimb::advance(const GraphView& graph, const ProbeState& probe, SolverStep& step) noexcept {
  internal::clear(step);
  before_ = state_;
  if (!state_.place.valid()) return;
  search(graph, probe, step);
}

// A hand that keeps pulling without progress wants out: the budget grows.
void BoundedClimb::wait(const ProbeState& probe, double distance_um) noexcept {
  const double dt_s = probe.dt_s > 0 && std::isfinite(probe.dt_s) ? probe.dt_s : 0.0;
  const double pull_mm = 1e3 * (distance_um / probe.scale_um_m);
  if (1e3 * ((state_.place.p_W - state_.began_W).norm() / probe.scale_um_m) > climb_.reset_mm) {
    state_.patience_mm = 0;
    state_.began_W = state_.place.p_W;
  } else if (pull_mm > climb_.pull_mm) {
    state_.patience_mm =
        std::min(state_.patience_mm + climb_.patience_1_s * (pull_mm - climb_.pull_mm) * dt_s, climb_.most_mm);
  } else {
    state_.patience_mm *= std::max(0.0, 1.0 - dt_s / kForget_s);
  }
}

void BoundedClimb::search(const GraphView& graph, const ProbeState& probe, SolverStep& step) noexcept {
  const Vector3d& h_W = probe.h_W;
  const double d2 = (state_.place.p_W - h_W).squaredNorm();
  if (!internal::usableDistance(d2) || !active_.follow(graph, state_.place, state_.segment, step)) return;
  const bool scaled = probe.scale_um_m > 0 && std::isfinite(probe.scale_um_m);
  if (scaled) wait(probe, std::sqrt(d2));

  ++step.visited;
  const ClosestPoint q = closestPoint(active_.child_W, active_.parent_W, h_W);
  const bool nearer = q.squared_distance < d2;
  best_ = Best{};
  if (nearer) best_ = {active_.tile, active_.segment, q.t, q.p_W, 0};
  const double best2 = nearer ? q.squared_distance : d2;
  best_.yields_below = yieldsBelow(best2);

  budget_um_ = 0;
  if (scaled) {
    const double pull_mm = 1e3 * (std::sqrt(best2) / probe.scale_um_m);
    const double budget_mm = std::min(climb_.most_mm, climb_.rest_mm + climb_.gain * pull_mm + state_.patience_mm);
    budget_um_ = 1e-3 * budget_mm * probe.scale_um_m;
  }

  numbers_.forget();
  offers_ = 0;
  const double length = (active_.parent_W - active_.child_W).norm();
  offer(active_.child_id, *active_.tile, active_.child, length * std::min(q.t, state_.place.t));
  offer(active_.parent_id, *active_.tile, active_.parent, length * (1.0 - std::max(q.t, state_.place.t)));
  while (offers_ > 0) {
    const std::uint32_t number = heap_[0].number;
    std::pop_heap(heap_.begin(), heap_.begin() + static_cast<std::ptrdiff_t>(offers_--));
    if (nodes_[number].progress != Progress::offered) continue;
    if (!follow(graph, h_W, number, step)) break;
  }
  if (!step.capped) state_.cut_node = NodeId{UINT32_MAX, UINT32_MAX};
  settle(graph);
}

// No more than one offer for each segment tested, and one for the other end of the first: the arrays hold them all.
void BoundedClimb::offer(NodeId id, const Tile& tile, std::uint32_t node, double cost) noexcept {
  if (!(cost <= budget_um_)) return;
  const std::uint32_t met = numbers_.size();
  const std::uint32_t number = numbers_.put(id);
  if (number == met) {
    nodes_[number] = {cost, id, &tile, node, Progress::offered};
  } else {
    if (!(cost < nodes_[number].cost)) return;
    nodes_[number].cost = cost;
  }
  stars_.prefetch(id);
  heap_[offers_++] = {cost, id.key(), number};
  std::push_heap(heap_.begin(), heap_.begin() + static_cast<std::ptrdiff_t>(offers_));
}

struct Branch {  // of a node at its home
  std::uint32_t segment, rank, far;
  NodeId far_id;
  bool loops;  // to the node itself
};

// Branches of the node, as its star has them.
struct StarBranches {
  const internal::StarCache::Star& star;

  std::uint32_t degree() const noexcept { return star.degree; }
  Branch branch(std::uint32_t at) const noexcept {
    const internal::StarCache::Ray& ray = star.rays[at];
    return {ray.segment, ray.rank, ray.far, {star.id.cell, ray.far_rank}, ray.far == star.node};
  }
  bool farIsParent(std::uint32_t at) const noexcept { return star.rays[at].from_child; }
  const Vector3d& far_W(std::uint32_t at, const Branch&) const noexcept { return star.rays[at].far_W; }
  const Vector3d& node_W() const noexcept { return star.p_W; }
};

// The same of a node with too many for that, as its tile has them.
struct TileBranches {
  const Tile& tile;
  std::uint32_t node;
  decltype(tile.incident(0)) incident = tile.incident(node);
  Vector3d own_W = tile.position_W(node);

  std::uint32_t degree() const noexcept { return static_cast<std::uint32_t>(incident.size()); }
  Branch branch(std::uint32_t at) const noexcept {
    const std::uint32_t segment = incident[at];
    const Tile::Link link = tile.link(segment);
    if (link.child == node) return {segment, link.id.segment, link.parent, link.parent_id, link.parent == node};
    return {segment, link.id.segment, link.child, link.child_id, false};
  }
  bool farIsParent(std::uint32_t at) const noexcept { return tile.child(incident[at]) == node; }
  Vector3d far_W(std::uint32_t, const Branch& branch) const noexcept { return tile.position_W(branch.far); }
  const Vector3d& node_W() const noexcept { return own_W; }
};

// False at the cap.
[[gnu::flatten]] bool BoundedClimb::follow(const GraphView& graph, const Vector3d& h_W, std::uint32_t number,
                                           SolverStep& step) noexcept {
  Node& met = nodes_[number];
  if (const internal::StarCache::Star* star = stars_.find(graph, met.id, *met.tile, met.node)) {
    met.progress = Progress::done;
    step.touched.add(star->home);
    return testBranches(*star->tile, met.id, met.cost, h_W, step, StarBranches{*star});
  }
  const GraphView::HomeNode home = graph.home(*met.tile, met.node);
  if (!home.present()) {
    met.progress = Progress::absent;
    ++step.frontiers;
    if (home.frontier()) step.absent.add(home.home);
    return true;
  }
  met.progress = Progress::done;
  step.touched.add(home.home);
  return testBranches(*home.tile, met.id, met.cost, h_W, step, TileBranches{*home.tile, home.node});
}

// A segment has been tested exactly if one of its ends is done, or if it is the first: so nodes are all that is marked.
template <typename Branches>
bool BoundedClimb::testBranches(const Tile& home, NodeId id, double cost, const Vector3d& h_W, SolverStep& step,
                                const Branches& branches) noexcept {
  const std::uint32_t degree = branches.degree();
  const Vector3d node_W = branches.node_W();
  std::uint32_t at = id == state_.cut_node && state_.cut_next < degree ? state_.cut_next : 0;
  for (std::uint32_t i = 0; i < degree; ++i, at = at + 1 == degree ? 0 : at + 1) {
    const Branch branch = branches.branch(at);
    if (branch.rank == active_.id.segment) continue;  // all that is reached is of one cell
    if (!branch.loops) {
      const std::uint32_t other = numbers_.find(branch.far_id);
      if (other != NodeNumbers::kNone && nodes_[other].progress == Progress::done) continue;
    }
    if (step.visited == max_visited_) {
      step.capped = true;
      state_.cut_node = id;
      state_.cut_next = at;
      return false;
    }
    ++step.visited;
    const Vector3d far_W = branches.far_W(at, branch);
    const ClosestPoint w =
        branches.farIsParent(at) ? closestPoint(node_W, far_W, h_W) : closestPoint(far_W, node_W, h_W);
    if (w.squared_distance < best_.yields_below)
      best_ = {&home, branch.segment, w.t, w.p_W, yieldsBelow(w.squared_distance)};
    offer(branch.far_id, home, branch.far, cost + (far_W - w.p_W).norm());
  }
  return true;
}

void BoundedClimb::settle(const GraphView& graph) noexcept {
  if (best_.tile == nullptr) return;
  if (best_.tile == active_.tile && best_.segment == active_.segment && !state_.place.at_node && best_.t != 0.0 &&
      best_.t != 1.0) {  // it slides along, and nothing else changes
    state_.place.t = best_.t;
    state_.place.p_W = best_.p_W;
    return;
  }
  state_.place = graph.placeOn(*best_.tile, best_.segment, best_.t, best_.p_W);
  state_.segment = best_.segment;
}

}  // namespace

std::unique_ptr<ProxySolver> makeBoundedClimb(const SolverParameters& parameters) {
  return std::make_unique<BoundedClimb>(parameters);
}

}  // namespace filiform
