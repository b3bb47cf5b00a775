#include "solver/internal/quick_sweep.h"

#include <algorithm>
#include <limits>

namespace filiform::internal {

struct QuickSweep::Sweep {
  QuickSweep& own;
  const GraphView& graph;
  const Reach& reach;
  const Vector3d& h_W;
  const std::uint32_t most_tests;
  SolverStep& step;
  BestPoint& best;
  std::uint32_t first_segment = kNone;  // rank of the one it starts on
  std::uint32_t looks = 0;

  std::uint32_t find(std::uint32_t sample) const noexcept {
    for (std::uint32_t i = 0; i < own.entered_; ++i)
      if (own.samples_[i] == sample) return i;
    return kNone;
  }

  void push(const Tile& tile, std::uint32_t node, std::uint32_t via, double sub_goal2) noexcept {
    own.stack_[own.depth_++] = {&tile, node, via, kNone, 0, sub_goal2};
  }

  // `near` is the end by which the segment was met (kNone: neither), `far_entered` whether the other one was entered.
  void test(const Tile& tile, std::uint32_t segment, std::uint32_t near, bool far_entered, double sub_goal2) noexcept {
    ++step.visited;
    const std::uint32_t child = tile.child(segment), parent = tile.parent(segment);
    const Vector3d child_W = tile.position_W(child), parent_W = tile.position_W(parent);
    const ClosestPoint q = closestPoint(child_W, parent_W, h_W);
    best.offer(tile, segment, q);
    const auto goOn = [&](std::uint32_t node, double goal2) {
      if (node == near || (near != kNone && far_entered)) return;
      push(tile, node, segment, goal2);
    };
    if (child_W == parent_W) {
      if (parent != child) goOn(parent, sub_goal2);
      goOn(child, sub_goal2);
      return;
    }
    follow(reach, child_W, parent_W, q, sub_goal2,
           [&](bool at_parent) { goOn(at_parent ? parent : child, q.squared_distance); });
  }

  bool enter(Entry& top) noexcept {
    if (!top.tile->isHome(top.node)) {
      const GraphView::HomeNode home = graph.home(*top.tile, top.node);
      if (!home.present()) return false;
      top.tile = home.tile;
      top.node = home.node;
      top.via = kNone;
    }
    top.entry = own.entered_++;
    own.samples_[top.entry] = top.tile->nodeId(top.node).sample;
    own.passed_[top.entry] = -1;
    step.touched.add(top.tile->id());
    return true;
  }

  bool run() noexcept {
    while (own.depth_ > 0) {
      Entry& top = own.stack_[own.depth_ - 1];
      if (top.entry == kNone) {
        if (find(top.tile->nodeId(top.node).sample) != kNone) {
          --own.depth_;
          continue;
        }
        if (!enter(top)) return false;
      }
      const Tile& tile = *top.tile;
      const std::uint32_t node = top.node, entry = top.entry, via = top.via;
      const double sub_goal2 = top.sub_goal2;
      const auto incident = tile.incident(node);
      std::uint32_t next = top.next;
      const auto end = static_cast<std::uint32_t>(incident.size());
      const std::uint32_t depth = own.depth_;
      bool popped = false;
      while (next < end) {
        const std::uint32_t segment = incident[next++];
        if (++looks > kMostLooks) return false;
        if (segment == via) continue;
        const std::uint32_t rank = tile.segmentId(segment).segment;
        if (rank == first_segment) continue;
        const std::uint32_t child = tile.child(segment), far = child == node ? tile.parent(segment) : child;
        const std::uint32_t other = far == node ? kNone : find(tile.nodeId(far).sample);
        if (other != kNone && own.passed_[other] >= rank) continue;
        if (step.visited == most_tests) return false;
        own.passed_[entry] = rank;
        // An entry that has nothing left goes before its last branch is followed.
        popped = next == end;
        if (popped)
          --own.depth_;
        else
          top.next = next;
        test(tile, segment, node, other != kNone, sub_goal2);
        if (popped || own.depth_ != depth) break;
      }
      if (!popped && next == end) --own.depth_;
    }
    return true;
  }
};

bool QuickSweep::fromSegment(const GraphView& graph, const Reach& reach, const Tile& tile, std::uint32_t segment,
                             const Vector3d& h_W, std::uint32_t most_tests, SolverStep& step,
                             BestPoint& best) noexcept {
  entered_ = depth_ = 0;
  Sweep sweep{*this, graph, reach, h_W, std::min(most_tests, kMostTests), step, best};
  sweep.first_segment = tile.segmentId(segment).segment;
  sweep.test(tile, segment, kNone, false, std::numeric_limits<double>::infinity());
  return sweep.run();
}

bool QuickSweep::fromNode(const GraphView& graph, const Reach& reach, const Tile& home, std::uint32_t node,
                          const Vector3d& h_W, std::uint32_t most_tests, SolverStep& step, BestPoint& best) noexcept {
  entered_ = depth_ = 0;
  Sweep sweep{*this, graph, reach, h_W, std::min(most_tests, kMostTests), step, best};
  sweep.push(home, node, kNone, std::numeric_limits<double>::infinity());
  return sweep.run();
}

}  // namespace filiform::internal
