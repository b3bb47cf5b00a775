// The engine of the basic and the force-based solver: a depth-first search over the working graph in bounded ticks.
//
// The paper writes the search as a recursion (Raya et al. 2011, 3.1 and 3.3):
//
//   segment(s, entered): skip if visited, else mark as visited;  q = closest point of s to h;  if q is nearer than the
//                        best: best = q;  the method decides from which ends of s to continue (Reach)
//   node(n):             skip if visited, else mark as visited;  segment(s, n) for every s at n, in the order of ids
//
// This engine runs it in exactly that order, with an explicit stack of nodes: *pending* nodes, and *entered* nodes with
// the position in their list of edges. Only nodes have labels, and that is enough: a search never leaves its cell, and
// lists are in the order of ids. So a segment has been tested exactly if it is the first segment, or if one of its ends
// was entered and has passed it. A segment of length zero is passed: q is the end from which it was not entered (both
// ends, if the search starts on it), and the search continues there with an unchanged sub-goal.
//
// A *sweep* is one such search, from a place to an empty stack. Most sweeps end within their tick. Otherwise the next
// tick continues the sweep, with labels and stack.
//
// Invariants (each has a test):
// 1. |place - h| never rises within a tick, whatever the method: the best point starts as the old place, and only a
//    strictly nearer point replaces it. So at a fixed h the proxy cannot oscillate.
// 2. Tested segments <= max_visited a tick. Entries looked at (edges that were tested before, stack entries that were
//    entered or popped) <= kScansPerTest * max_visited + 1 a tick. A tick that reaches one of these bounds is *capped*.
// 3. Stack size <= nodes labelled in the sweep + 2: a fixed array.
// 4. If h does not move during a sweep, the sweep ends at the place of the unbounded recursion, bit for bit, in however
//    many ticks.
// 5. A tile is reported absent exactly if the search, within its bounds, would have read it. If that tile is loaded,
//    undo() and the same tick again continue past it. So the answer with all such tiles loaded is that of the whole
//    graph in memory.
// 6. undo() costs no more than the tick.
//
// If h has moved since the last tick of an unfinished sweep, the tick has three steps. It tests the active segment
// again, so that the proxy slides along with the hand. It continues the sweep with the new h; sub-goals are stored as
// points, so their distances are measured to the new h. If the sweep ends before a bound is reached, a new sweep starts
// from the place. So a hub of N branches is tested completely every N / max_visited + 1 ticks, even if the hand never
// rests. If the labels are full, the sweep ends (capped), and the next tick starts a new one. Thread rule: haptic
// thread only.
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
  // Enough for a hub of 10 000 branches whose far ends are all entered.
  static constexpr std::uint32_t kLeastLabels = 12288;

  const ProxyPlace& place() const noexcept override { return state_.place; }
  void setPlace(const ProxyPlace& place) noexcept override;
  // Like setPlace(), in the same graph: keeps the decoded nodes.
  void restart(const ProxyPlace& place) noexcept {
    state_ = State{};
    state_.place = place;
    undo_ = Undo::nothing;
  }
  void setReach(const CellReach& reach) noexcept override {
    reach_.r_min_um = reach.r_min_um;
    reach_.r_max_um = reach.r_max_um;
  }
  void advance(const GraphView& graph, const ProbeState& probe, SolverStep& step) noexcept override;
  void undo() noexcept override;
  void prepare(const GraphView& graph, const Vector3d& ahead_W, std::uint32_t most) noexcept override;

 private:
  struct Tick {
    const Vector3d& h_W;
    SolverStep& step;
    std::uint32_t scans = 0;
    // The best so far: on edge `edge` of node `node`; kNone: on the active segment.
    bool improved = false;
    std::uint32_t node = WorkingGraph::kNone, edge = 0;
    ClosestPoint best{};
  };
  struct Entry {
    std::uint32_t node;  // local index in the working graph
    std::uint32_t next;  // the next edge to look at
    bool entered;
    Vector3d sub_goal_W;
  };
  struct State {
    ProxyPlace place;
    // Of an unfinished sweep:
    std::uint32_t depth = 0;          // entries on the stack
    bool moved = false;               // h has moved since the sweep began
    bool starts_on_segment = false;   // the sweep began on segment `first`, else at a node
    std::uint32_t first = 0;          // rank
    Vector3d h_W = Vector3d::Zero();  // of the last tick
  };
  struct Change {
    std::uint32_t node;
    WorkingGraph::Label before;
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
  WorkingGraph::Label& label(std::uint32_t n) noexcept;
  void push(std::uint32_t n, const Vector3d& sub_goal_W) noexcept;
  Entry& touchTop() noexcept;
  void giveUp(Tick& tick) noexcept;

  std::uint32_t max_visited_, max_scans_;
  Reach reach_;
  WorkingGraph graph_;
  ActiveSegment active_;
  State state_, before_;
  std::vector<Entry> stack_;
  // For undo(). A tick that began with a new sweep saves only the place, if it changed. A tick that continued a sweep
  // saves the whole state, the labels that it changed, and the stack entries that it touched, top first.
  enum class Undo : std::uint8_t { nothing, sweep, all };
  Undo undo_ = Undo::nothing;
  bool keeps_place_ = false;
  bool resumed_ = false;
  WorkingGraph::Search search_before_;
  std::vector<Change> changes_;
  std::size_t changed_ = 0;
  std::vector<Entry> touched_;
  std::uint32_t untouched_ = 0;  // number of entries at the bottom of the stack that were not touched
};

}  // namespace filiform::internal
