// The engine of the basic and the force-based solver: a depth-first search over the working graph in bounded ticks.
//
// It runs what the paper writes as a recursion (Raya et al. 2011, 3.1 and 3.3),
//
//   segment(s, entered): skip if marked, mark;  q = closest point of s to h;  q nearer than the best: it is the best;
//                        the method says from which ends of s to go on (Reach)
//   node(n):             skip if marked, mark;  segment(s, n) for every incident s in the order of identity
//
// in exactly that order, with an explicit stack of nodes: *pending* ones, and *entered* ones with the position in their
// list of edges. Only nodes are marked. All that a search reaches is of one cell, and lists are in the order of
// identity: so a segment has been tested exactly if it is the first, or if an end of it has been entered and has passed
// it. A segment of equal ends is transparent: q is the end that was not entered from (both, where the search begins on
// it), and the search goes on there with the sub-goal it came with.
//
// A *sweep* is one such search, from a place to an empty stack. Most end within their tick. One that does not is
// resumed by the next tick, marks and stack kept.
//
// Invariants (each a test):
//  1. |place - h| never rises within a tick, whatever the method: the best starts as the old place and yields only to
//     strictly nearer points. So at fixed h the proxy cannot oscillate.
//  2. Tested segments <= max_visited a tick. Entries looked at (edges tested already, stack entries entered or popped)
//     <= kScansPerTest * max_visited + 1 a tick. Either bound ends the tick as *capped*.
//  3. Stack <= nodes marked in the sweep + 2: a fixed array.
//  4. A sweep during which h does not move ends with the place of the unbounded recursion, bit for bit, in however many
//     ticks.
//  5. A tile is reported absent exactly when the search, within its bounds, would have read it. With that tile loaded,
//     undo() and the same tick again go on past it. So the answer with all such tiles loaded is that of the whole graph
//     in memory.
//  6. undo() costs no more than the tick did.
//
// When h has moved since the last tick of an unfinished sweep, the active segment is tested again first (the proxy
// slides along with the hand), the rest of the sweep runs against the new h (sub-goals are kept as points, so their
// distances are those to the new h), and when it ends with work to spare a new sweep from the place follows in the same
// tick. So a hub of N branches is seen whole every N / max_visited + 1 ticks, even under a hand that never rests. Marks
// full: the sweep is given up (capped), the next starts from the place. Thread rule: haptic thread only.
#pragma once

#include "solver/graph/internal/working_graph.h"
#include "solver/proxy/internal/active_segment.h"
#include "solver/proxy/internal/reach.h"
#include "solver/proxy/proxy_solver.h"

#include <vector>

namespace filiform::internal {

class BoundedSearch final : public ProxySolver {
 public:
  // 4 MB at the default. Requires 1 <= max_visited <= kMostVisited.
  BoundedSearch(std::uint32_t max_visited, std::uint32_t pool_nodes, const Reach& reach);

  static constexpr std::uint32_t kMostVisited = 1u << 20;
  static constexpr std::uint32_t kScansPerTest = 8;
  // A hub of 10 000 branches, all of whose far ends are entered, fits.
  static constexpr std::uint32_t kLeastMarks = 12288;

  const ProxyPlace& place() const noexcept override { return state_.place; }
  void setPlace(const ProxyPlace& place) noexcept override;
  void advance(const GraphView& graph, const ProbeState& probe, SolverStep& step) noexcept override;
  void undo() noexcept override;
  void prepare(const GraphView& graph, const Vector3d& ahead_W, std::uint32_t most) noexcept override;

 private:
  struct Tick {
    const Vector3d& h_W;
    SolverStep& step;
    std::uint32_t scans = 0;
    // The best so far: edge `edge` of node `node`, or the active segment where that is kNone.
    bool improved = false;
    std::uint32_t node = WorkingGraph::kNone, edge = 0;
    ClosestPoint best{};
  };
  struct Entry {
    std::uint32_t node;  // in the working graph
    std::uint32_t next;  // edge
    bool entered;
    Vector3d sub_goal_W;
  };
  struct State {
    ProxyPlace place;
    // Of an unfinished sweep:
    std::uint32_t depth = 0;          // entries on the stack
    bool moved = false;               // h has moved since it began
    bool starts_on_segment = false;   // it began on `first`
    std::uint32_t first = 0;          // a segment's rank
    Vector3d h_W = Vector3d::Zero();  // of the last tick
  };
  struct Change {
    std::uint32_t node;
    WorkingGraph::Mark before;
  };

  void resume(Tick& tick) noexcept;
  void sweep(Tick& tick, bool beside) noexcept;
  void slide(Tick& tick) noexcept;
  void run(Tick& tick) noexcept;
  bool enter(Tick& tick, Entry& top) noexcept;
  void testActive(Tick& tick) noexcept;
  void test(Tick& tick, std::uint32_t n, std::uint32_t i, WorkingGraph::Edge& edge,
            const Vector3d& sub_goal_W) noexcept;
  bool isTested(std::uint32_t n, const WorkingGraph::Edge& edge) const noexcept;
  void offer(Tick& tick, const ClosestPoint& q, std::uint32_t node, std::uint32_t edge) const noexcept;
  void settle(Tick& tick) noexcept;
  WorkingGraph::Mark& mark(std::uint32_t n) noexcept;
  void push(std::uint32_t n, const Vector3d& sub_goal_W) noexcept;
  Entry& touchTop() noexcept;
  void giveUp(Tick& tick) noexcept;

  std::uint32_t max_visited_, max_scans_;
  Reach reach_;
  WorkingGraph graph_;
  ActiveSegment active_;
  State state_, before_;
  std::vector<Entry> stack_;
  // For undo(): the place where the tick changed it. Of a tick that resumed a sweep all, with the marks it changed and
  // the stack entries it touched, top first.
  enum class Undo : std::uint8_t { nothing, sweep, all };
  Undo undo_ = Undo::nothing;
  bool keeps_place_ = false;
  bool resumed_ = false;
  WorkingGraph::Search search_before_;
  std::vector<Change> changes_;
  std::size_t changed_ = 0;
  std::vector<Entry> touched_;
  std::uint32_t untouched_ = 0;  // entries from the bottom
};

}  // namespace filiform::internal
