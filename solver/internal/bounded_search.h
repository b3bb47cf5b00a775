// The engine under the basic and the force-based solver: a depth-first search over the graph of tiles in bounded ticks.
//
// It runs what the paper writes as a recursion (DESIGN 5.1, 5.2; the paper, 3.1 and 3.3),
//
//   segment(s, entered): skip if marked, mark;  q = closest point of s to h;  q nearer than the best: it is the best;
//                        the method says from which ends of s to go on
//   node(n):             skip if marked, mark;  segment(s, n) for every incident s in the order of identity
//
// in exactly that order, with an explicit stack. One entry of the stack is a node: *pending* (not marked yet) or
// *entered*, with the position in its incidence list. A segment of equal ends is transparent: q is the end that was not
// entered from (both, where the search begins on it), and the search goes on there with the sub-goal it came with, so
// that it is never a wall.
//
// A *sweep* is one such search, from a place to an empty stack. Most sweeps end within their tick, and are done by
// QuickSweep, which marks next to nothing. One that does not is resumed by the next tick, marks and stack kept.
//
// Invariants (each a test):
//  1. |place - h| never rises within a tick, whatever the method: the best starts as the old place and yields only to
//  strictly
//     nearer points. So at fixed h the proxy cannot oscillate.
//  2. Tested segments <= max_visited a tick, counted per segment. Entries looked at (incident segments already marked,
//  stack
//     entries entered or popped) <= kScansPerTest * max_visited + 1 a tick. Either bound ends the tick as *capped*.
//  3. Stack <= segments marked in the sweep + 1 <= capacity of the marks + 1: a fixed array.
//  4. A sweep during which h does not move ends with the place of the unbounded recursion, bit for bit, in however many
//  ticks.
//  5. A tile is reported absent exactly when the search, within its bounds, would have read it. With that tile loaded,
//  undo() and
//     the same tick again go on past it. So the answer with all such tiles loaded is that of the whole graph in memory.
//  6. undo() costs no more than the tick did.
//
// When h has moved since the last tick of an unfinished sweep, the active segment is tested again first (the proxy
// slides along with the hand), the rest of the sweep runs against the new h (sub-goals are kept as points, so their
// distances are those to the new h), and when it ends with work to spare a new sweep from the place follows in the same
// tick. So a hub of N branches is seen whole every N / max_visited + 1 ticks, even under a hand that never rests. Marks
// full: the sweep is given up (capped), the next starts from the place. Thread rule: haptic thread only.
#pragma once

#include "index/closest_point.h"
#include "solver/graph_view.h"
#include "solver/internal/quick_sweep.h"
#include "solver/marks.h"
#include "solver/proxy_solver.h"

#include <vector>

namespace filiform::internal {

class BoundedSearch final : public ProxySolver {
 public:
  // 2.5 MB at the default; grows with max_visited beyond 8192. Requires 1 <= max_visited <= kMostVisited.
  BoundedSearch(std::uint32_t max_visited, const Reach& reach);

  static constexpr std::uint32_t kMostVisited = 1u << 20;
  static constexpr std::uint32_t kScansPerTest = 8;
  // A hub of 10 000 branches, all of whose far ends are entered, fits.
  static constexpr std::uint32_t kLeastMarks = 24576;

  const ProxyPlace& place() const noexcept override { return state_.place; }
  void setPlace(const ProxyPlace& place) noexcept override;
  void advance(const GraphView& graph, const ProbeState& probe, SolverStep& step) noexcept override;
  void undo() noexcept override;

 private:
  static constexpr std::uint32_t kNoNode = UINT32_MAX;
  struct Tick {
    const GraphView& graph;
    const Vector3d& h_W;
    SolverStep& step;
    std::uint32_t scans = 0;
    BestPoint best;
  };
  struct Entry {
    NodeId id;
    TileId home;              // kNoTile: not looked up yet
    std::uint32_t node;       // in the home tile; kNoNode: not looked up yet
    std::uint32_t next, end;  // positions in the incidence list; end 0: pending
    Vector3d sub_goal_W;
    GridPoint point;  // of the node, where its home is not known
  };
  struct State {
    ProxyPlace place;
    Vector3d h_W = Vector3d::Zero();  // of the last tick
    bool moved = false;               // h moved since the unfinished sweep began
    std::uint32_t depth = 0;          // entries on the stack
    // Where the last tick found the place, to spare the search for it; confirmed by identity before use.
    std::uint32_t segment = 0;     // in tile place.tile
    TileId home = kNoTile;         // of place.node; kNoTile: not known
    std::uint32_t node = kNoNode;  // in that tile
  };

  bool shallowSweep(const GraphView& graph, const Vector3d& h_W, double old2, SolverStep& step) noexcept;
  void deepSweep(const GraphView& graph, const Vector3d& h_W, bool on_segment, double old2, SolverStep& step) noexcept;
  bool quickSweep(Tick& tick, bool on_segment) noexcept;
  void sweep(Tick& tick) noexcept;
  void startSweep(Tick& tick) noexcept;
  void findHome(const GraphView& graph) noexcept;
  void slide(Tick& tick) noexcept;
  void run(Tick& tick) noexcept;
  bool enter(Tick& tick, Entry& top) noexcept;
  void test(Tick& tick, const Tile& tile, std::uint32_t segment, const Vector3d& sub_goal_W) noexcept;
  GraphView::SegmentRef active(Tick& tick) noexcept;
  void settle(Tick& tick) noexcept;
  void settle(const GraphView& graph, const Tile& tile, std::uint32_t segment, double t, const Vector3d& p_W) noexcept;
  void keepForUndo() noexcept;
  // Does nothing for a node that is visited already.
  void goOn(const Tile& tile, std::uint32_t node, NodeId id, const Vector3d& sub_goal_W) noexcept;
  Entry& touchTop() noexcept;
  void pop() noexcept;
  void giveUp(Tick& tick) noexcept;

  std::uint32_t max_visited_, max_scans_;
  Reach reach_;
  // Of the neighbourhood, decoded.
  ActiveSegment active_;
  StarCache stars_;
  QuickSweep quick_;
  State state_, before_;
  Marks marks_;
  std::vector<Entry> stack_;
  // Of the entries on the stack when the tick began, those from `kept_above_` up have been touched and are kept in
  // `kept_`, top first.
  std::vector<Entry> kept_;
  std::uint32_t kept_above_ = 0;
  enum class Undo : std::uint8_t { nothing, slide, all };  // of the last tick; slide: t and p_W alone
  Undo undo_ = Undo::nothing;
};

}  // namespace filiform::internal
