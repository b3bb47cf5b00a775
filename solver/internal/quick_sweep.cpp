#include "solver/internal/quick_sweep.h"

#include <algorithm>
#include <limits>

namespace filiform::internal {

struct QuickSweep::Sweep {
  QuickSweep& own;
  const GraphView& graph;
  StarCache& stars;
  const Reach& reach;
  const Vector3d& h_W;
  const std::uint32_t most_tests;
  SolverStep& step;
  BestPoint& best;
  std::uint32_t first = kNone;  // rank of the segment it starts on
  std::uint32_t looks = 0;

  std::uint32_t find(std::uint32_t sample) const noexcept {
    for (std::uint32_t i = 0; i < own.entered_; ++i)
      if (own.samples_[i] == sample) return i;
    return kNone;
  }

  void push(NodeId id, const Tile& tile, std::uint32_t node, std::uint32_t via, double sub_goal2) noexcept {
    own.stack_[own.depth_++] = {id, &tile, node, via, kNone, 0, sub_goal2};
  }

  void testFirst(const ActiveSegment& active) noexcept {
    ++step.visited;
    const ClosestPoint q = active.closestTo(h_W);
    first = active.id.segment;
    best.offer(*active.tile, active.segment, q);
    const auto goOn = [&](bool at_parent, double sub_goal2) {
      if (at_parent)
        push(active.parent_id, *active.tile, active.parent, first, sub_goal2);
      else
        push(active.child_id, *active.tile, active.child, first, sub_goal2);
    };
    constexpr double kUnbounded = std::numeric_limits<double>::infinity();
    if (active.length2 == 0.0) {
      goOn(true, kUnbounded);
      goOn(false, kUnbounded);
      return;
    }
    follow(reach, active.child_W, active.parent_W, q, reach.bound2(kUnbounded, best.squared_distance),
           [&](bool at_parent) { goOn(at_parent, q.squared_distance); });
  }

  // A branch of an entered node. `far_entered`: so is the other end.
  void test(const StarCache::Star& star, const StarCache::Ray& ray, bool far_entered, double sub_goal2) noexcept {
    ++step.visited;
    const Vector3d &child_W = ray.from_child ? star.p_W : ray.far_W, &parent_W = ray.from_child ? ray.far_W : star.p_W;
    const ClosestPoint q = closestPoint(child_W, parent_W, h_W);
    best.offer(*star.tile, ray.segment, q);
    if (far_entered || ray.far == star.node) return;  // nowhere to go on to
    const NodeId far{star.id.cell, ray.far_rank};
    if (child_W == parent_W) return push(far, *star.tile, ray.far, ray.rank, sub_goal2);
    follow(reach, child_W, parent_W, q, reach.bound2(sub_goal2, best.squared_distance), [&](bool at_parent) {
      if (at_parent == ray.from_child) push(far, *star.tile, ray.far, ray.rank, q.squared_distance);
    });
  }

  bool run() noexcept {
    while (own.depth_ > 0) {
      // Here BoundedSearch would stop as capped, before it asks whether the next node is resident.
      if (step.visited == most_tests) return false;
      Entry& top = own.stack_[own.depth_ - 1];
      const bool pending = top.entry == kNone;
      if (pending && find(top.id.sample) != kNone) {
        --own.depth_;
        continue;
      }
      const StarCache::Star* star = stars.find(graph, top.id, *top.tile, top.node);
      if (star == nullptr) return false;
      if (pending) {
        top.entry = own.entered_++;
        own.samples_[top.entry] = top.id.sample;
        own.passed_[top.entry] = -1;
        step.touched.add(star->home);
      }
      const std::uint32_t entry = top.entry, via = top.via, end = star->degree, depth = own.depth_;
      const double sub_goal2 = top.sub_goal2;
      std::uint32_t next = top.next;
      bool popped = false;
      while (next < end) {
        const StarCache::Ray& ray = star->rays[next++];
        if (++looks > kMostLooks) return false;
        if (ray.rank == via || ray.rank == first) continue;
        const std::uint32_t other = ray.far == star->node ? kNone : find(ray.far_rank);
        if (other != kNone && own.passed_[other] >= ray.rank) continue;
        if (step.visited == most_tests) return false;
        own.passed_[entry] = ray.rank;
        // An entry that has nothing left goes before its last branch is followed.
        popped = next == end;
        if (popped)
          --own.depth_;
        else
          top.next = next;
        test(*star, ray, other != kNone, sub_goal2);
        if (popped || own.depth_ != depth) break;
      }
      if (!popped && next == end) --own.depth_;
    }
    return true;
  }
};

[[gnu::flatten]] bool QuickSweep::fromSegment(const GraphView& graph, StarCache& stars, const Reach& reach,
                                              const ActiveSegment& active, const Vector3d& h_W,
                                              std::uint32_t most_tests, SolverStep& step, BestPoint& best) noexcept {
  entered_ = depth_ = 0;
  Sweep sweep{*this, graph, stars, reach, h_W, std::min(most_tests, kMostTests), step, best};
  sweep.testFirst(active);
  return depth_ == 0 || sweep.run();
}

[[gnu::flatten]] bool QuickSweep::fromNode(const GraphView& graph, StarCache& stars, const Reach& reach, NodeId id,
                                           const Tile& tile, std::uint32_t node, const Vector3d& h_W,
                                           std::uint32_t most_tests, SolverStep& step, BestPoint& best) noexcept {
  entered_ = depth_ = 0;
  Sweep sweep{*this, graph, stars, reach, h_W, std::min(most_tests, kMostTests), step, best};
  sweep.push(id, tile, node, kNone, std::numeric_limits<double>::infinity());
  return sweep.run();
}

}  // namespace filiform::internal
