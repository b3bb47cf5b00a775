// The graph around the proxy, decoded: nodes by local index, each with its edges as the solvers use them, and the marks
// of the search that is under way.
//
//   graph.begin(view);  graph.newSearch();
//   const std::uint32_t n = graph.meet({id, p_W});       // a local index, valid as long as the search has marked it
//   if (graph.open(n) == WorkingGraph::Presence::present)
//     for (std::uint32_t i = 0; i < graph.node(n).degree; ++i) graph.edge(n, i);
//
// What is decoded follows from the content of one tile, a node's home, and holds as long as the set is the same. It is
// kept from search to search, so that a warm tick reads no tile: the last `pool` nodes met, and their edges. Nodes
// decoded ahead of the hand, between ticks, make a cold tick warm (prepare()). The pool changes no path: a node that is
// not kept is decoded again, and a node of more than kMostEdges segments is read from its tile each time.
//
// A tile that retires takes its own nodes out alone: a node is used only while its home is resident. All members but
// the constructor are noexcept, without allocation, lock or system call. Thread rule: haptic thread only.
#pragma once

#include "index/geometry/closest_point.h"
#include "solver/graph/graph_view.h"
#include "solver/graph/proxy_place.h"

#include <cstdint>
#include <vector>

namespace filiform::internal {

class WorkingGraph {
 public:
  static constexpr std::uint32_t kNone = UINT32_MAX;
  static constexpr std::uint32_t kMostEdges = 16;  // kept of a node
  static constexpr std::uint32_t kPrepared = 512;

  struct Edge {             // of a node, in the node's home tile
    Vector3d far_W;         // the other end
    double length2;         // squared, um^2
    double length;          // um
    std::uint32_t segment;  // in the home tile
    std::uint32_t rank;     // of the segment, in the node's cell
    std::uint32_t far;      // in the home tile; the node itself: a loop
    std::uint32_t far_rank;
    std::uint32_t to;  // local index of the far node where last seen; confirmed by identity before use
    bool from_child;   // the node is the segment's child

    NodeId farId(NodeId node) const noexcept { return {node.cell, far_rank}; }
    // As closestPoint() of the segment, child to parent; `node_W` is this end.
    [[gnu::always_inline]] ClosestPoint closestTo(const Vector3d& node_W, const Vector3d& h_W) const noexcept {
      const Vector3d &child_W = from_child ? node_W : far_W, &parent_W = from_child ? far_W : node_W;
      return closestPoint(child_W, parent_W, parent_W - child_W, length2, h_W);
    }
    double nearT() const noexcept { return from_child ? 0.0 : 1.0; }  // t of this end
    double farT() const noexcept { return from_child ? 1.0 : 0.0; }
  };

  enum class Progress : std::uint8_t { met, entered, absent };
  struct Mark {
    std::uint64_t search = 0;  // another than the present one: not met in it
    double cost = 0;           // bounded climb: uphill arc length to here, um
    std::uint32_t passed = 0;  // descent: edges of this rank and below have been followed; counts once one has
    bool has_passed = false;
    Progress progress = Progress::met;
  };
  struct Node {
    Vector3d p_W = Vector3d::Zero();
    NodeId id{UINT32_MAX, UINT32_MAX};
    const Tile* tile = nullptr;   // its home, once it was open
    std::uint64_t edges_at = 0;   // in the order of decoding; see holdsEdges()
    TileId home = kNoTile;        // kNoTile: not looked up yet
    std::uint32_t node = kNone;   // in the home tile; kNone: not looked up yet
    std::uint32_t degree = 0;     // once it was open
    std::uint32_t next = kNone;   // with the same hash
    std::uint32_t residency = 0;  // when its home was last seen resident
    std::uint32_t prepared = 0;   // by which pass of prepare() it was reached
    std::uint64_t met = 0;        // its number in the order of meeting
    Mark mark;
  };

  // Keeps `pool` nodes beside the `most_marked` that a search may mark, and `most_in_tick` that a second search of the
  // same tick may. About 0.4 KB for each of the pool, 0.1 KB for each of the others.
  WorkingGraph(std::uint32_t pool, std::uint32_t most_marked, std::uint32_t most_in_tick);

  // At the start of a tick. The view must last until its end.
  void begin(const GraphView& view) noexcept {
    view_ = &view;
    pinned_ = search_;
    if (tiles_ == &view.tiles() && changes_ == view.tiles().changes()) return;
    tiles_ = &view.tiles();
    changes_ = view.tiles().changes();
    ++residency_;
  }
  // Before another graph, which may give other nodes the same ids. Forgets marks too. O(1).
  void forget() noexcept;

  // No node is marked any more. `beside`: the nodes of the search before stay until the tick ends, for resume(). O(1).
  void newSearch(bool beside = false) noexcept {
    ++search_;
    marked_ = 0;
    if (!beside) pinned_ = search_;
  }
  struct Search {
    std::uint64_t number = 0;
    std::uint32_t marked = 0;
  };
  Search search() const noexcept { return {search_, marked_}; }
  // The marks themselves are the caller's to restore.
  void resume(const Search& search) noexcept {
    search_ = search.number;
    marked_ = search.marked;
  }

  const Node& node(std::uint32_t n) const noexcept { return nodes_[n]; }
  bool isMarked(std::uint32_t n) const noexcept { return nodes_[n].mark.search == search_; }
  // The node's mark, met now if it was not in this search. Requires room.
  Mark& mark(std::uint32_t n) noexcept {
    Mark& mark = nodes_[n].mark;
    if (mark.search != search_) {
      mark = Mark{search_, 0, 0, false, Progress::met};
      ++marked_;
    }
    return mark;
  }
  void restore(std::uint32_t n, const Mark& mark) noexcept { nodes_[n].mark = mark; }
  bool full() const noexcept { return marked_ >= most_marked_; }

  // A node as a tile or a place has it; home and index where they are known.
  struct Seen {
    NodeId id;
    Vector3d p_W;
    TileId home = kNoTile;
    std::uint32_t node = kNone;
  };
  bool isKept(std::uint32_t n, NodeId id) const noexcept {  // still at that local index
    return n < nodes_.size() && nodes_[n].id == id && isKept(nodes_[n]);
  }
  // Its local index; kNone: not kept. O(1) expected.
  std::uint32_t find(NodeId id) const noexcept;
  // The same; a node that is not kept is kept from now on. Requires room: full() is false.
  std::uint32_t meet(const Seen& seen) noexcept {
    const std::uint32_t n = find(seen.id);
    return n != kNone ? n : add(seen);
  }
  // The node at the far end of an edge of `n`.
  std::uint32_t findFar(std::uint32_t n, const Edge& edge) const noexcept {
    const NodeId id = edge.farId(nodes_[n].id);
    return isKept(edge.to, id) ? edge.to : find(id);
  }
  std::uint32_t meetFar(std::uint32_t n, Edge& edge) noexcept {
    const NodeId id = edge.farId(nodes_[n].id);
    if (!isKept(edge.to, id)) edge.to = meetNew(nodes_[n], edge);
    return edge.to;
  }

  // `nowhere`: no tile is home to it, never so in a sound set.
  enum class Presence : std::uint8_t { present, absent, nowhere };
  // Its tile, degree and edges may be asked for until another node is opened, if it is present. Of one that is absent
  // its home is known. O(1) where it is kept.
  Presence open(std::uint32_t n) noexcept {
    const Node& node = nodes_[n];
    return node.residency == residency_ && holdsEdges(node) ? Presence::present : openSlowly(nodes_[n]);
  }
  // In the order of identity. Valid until another node is opened, of a node with more than kMostEdges until the next
  // call. Requires an open node.
  Edge& edge(std::uint32_t n, std::uint32_t i) noexcept {
    Node& node = nodes_[n];
    if (node.degree <= kMostEdges) [[likely]]
      return edges_[(node.edges_at & edge_mask_) + i];
    return read(node, i);
  }
  // Its edges will be asked for soon.
  void prefetch(std::uint32_t n) const noexcept {
    const Edge* edge = &edges_[nodes_[n].edges_at & edge_mask_];
    __builtin_prefetch(edge);
    __builtin_prefetch(edge + 1);
  }

  // Between ticks, while no search is unfinished: decodes nodes near the segment with the ends `from`, in the order of
  // arc length plus distance to `ahead_W`: `most` nodes a call, and kPrepared in all. It begins anew where the proxy or
  // `ahead_W` has moved by a quarter of how far it has come, or tiles have changed. Does not report absent tiles. About
  // 0.1 us a node.
  void prepare(const GraphView& view, const Seen (&from)[2], const Vector3d& ahead_W, std::uint32_t most) noexcept;

  const GraphView& view() const noexcept { return *view_; }

 private:
  struct Bucket {
    std::uint32_t generation = 0;  // another than the present one: empty
    std::uint32_t first = kNone;
  };
  struct Reached {  // by prepare()
    double cost;
    double arc_um;
    std::uint32_t node;
    bool operator<(const Reached& other) const noexcept { return cost > other.cost; }  // least on top
  };

  // Neighbouring samples lie side by side.
  std::size_t bucketOf(NodeId id) const noexcept { return (id.sample + id.cell * 0x9e3779b9u) & bucket_mask_; }
  bool isPinned(const Node& node) const noexcept { return node.mark.search >= pinned_; }
  bool isKept(const Node& node) const noexcept { return number_ - node.met < pool_ || isPinned(node); }
  bool holdsEdges(const Node& node) const noexcept {
    return node.degree > kMostEdges || edges_end_ - node.edges_at <= edges_.size();
  }
  std::uint32_t meetNew(const Node& node, const Edge& edge) noexcept;
  std::uint32_t add(const Seen& seen) noexcept;
  void reach(std::uint32_t n, double arc_um) noexcept;
  void remove(std::uint32_t n) noexcept;
  Presence openSlowly(Node& node) noexcept;
  void decode(Node& node, const Tile& tile) noexcept;
  void fill(Edge& edge, const Node& node, std::uint32_t segment, const Tile::Link& link) const noexcept;
  Edge& read(const Node& node, std::uint32_t i) noexcept;

  const GraphView* view_ = nullptr;
  const TileTable* tiles_ = nullptr;
  std::uint64_t changes_ = 0;  // of the tiles, as begin() saw them last
  std::uint32_t residency_ = 1;
  std::uint32_t pool_, most_marked_, marked_ = 0;
  std::uint64_t number_ = 0, forgotten_ = 0;  // nodes met, and those before forget()
  std::uint64_t search_ = 1, pinned_ = 1;     // searches from `pinned_` on keep their nodes
  std::uint32_t generation_ = 1, slot_ = 0;   // slot_: where the next node goes, unless pinned
  std::vector<Node> nodes_;
  std::vector<Bucket> buckets_;
  std::size_t bucket_mask_;
  std::vector<Edge> edges_;  // a ring
  std::uint64_t edge_mask_;
  std::uint64_t edges_end_;  // edges decoded so far
  Edge scratch_{};           // of a node with more than kMostEdges
  // Of prepare(): nodes to decode, a heap; how many were reached in this pass, and how far along the structure.
  std::vector<Reached> reached_;
  std::uint32_t pass_ = 1, reached_count_ = 0, most_reached_;
  double reached_um_ = 0;
  std::uint32_t prepared_residency_ = 0;  // 0: no pass was begun
  Vector3d from_W_ = Vector3d::Zero(), ahead_W_ = Vector3d::Zero();
};

}  // namespace filiform::internal
