// The decoded graph around the proxy: nodes with a local index, their edges, and the labels of the current search.
//
//   graph.begin(view);  graph.newSearch();
//   const std::uint32_t n = graph.meet({id, p_W});       // a local index, valid while the search has labelled the node
//   if (graph.open(n) == WorkingGraph::Presence::present)
//     for (std::uint32_t i = 0; i < graph.node(n).degree; ++i) graph.edge(n, i);
//
// A node is decoded from one tile, its home, and stays valid as long as the set does not change. The graph keeps the
// newest `pool` nodes and their edges, so a warm tick reads no tile. prepare() decodes nodes ahead of the hand between
// ticks, so that a cold tick becomes warm. The pool size changes no search result: a node that was dropped is decoded
// again, and a node with more than kMostEdges segments is always read from its tile.
//
// Retiring a tile removes only its own nodes: a node is used only while its home is in memory. All members except the
// constructor are noexcept and make no allocation, lock or system call. Thread rule: haptic thread only.
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
  static constexpr std::uint32_t kMostEdges = 16;  // decoded edges of a node
  static constexpr std::uint32_t kPrepared = 512;  // nodes that one pass of prepare() decodes

  struct Edge {      // of a node; indices are of the node's home tile
    Vector3d far_W;  // the other end
    double length2;  // squared, um^2
    double length;   // um
    std::uint32_t segment;
    std::uint32_t rank;  // of the segment in the cell
    std::uint32_t far;   // the other end; the node itself: a loop
    std::uint32_t far_rank;
    std::uint32_t to;  // last known local index of the other end; its id is checked before use
    bool from_child;   // the node is the segment's child

    NodeId farId(NodeId node) const noexcept { return {node.cell, far_rank}; }
    // closestPoint() of the segment from child to parent. `node_W`: position of the node.
    [[gnu::always_inline]] ClosestPoint closestTo(const Vector3d& node_W, const Vector3d& h_W) const noexcept {
      const Vector3d &child_W = from_child ? node_W : far_W, &parent_W = from_child ? far_W : node_W;
      return closestPoint(child_W, parent_W, parent_W - child_W, length2, h_W);
    }
    double nearT() const noexcept { return from_child ? 0.0 : 1.0; }  // t of this end
    double farT() const noexcept { return from_child ? 1.0 : 0.0; }
  };

  enum class Progress : std::uint8_t { met, entered, absent };
  struct Label {
    std::uint64_t search = 0;  // number of the search; another number: not met in the current search
    double cost = 0;           // bounded climb: uphill arc length to the node, um
    // If has_passed. Descent: edges of this rank and below are done. Bounded climb: rank of the segment by which the
    // search came.
    std::uint32_t passed = 0;
    bool has_passed = false;
    Progress progress = Progress::met;
  };
  struct Node {
    Vector3d p_W = Vector3d::Zero();
    NodeId id{UINT32_MAX, UINT32_MAX};
    const Tile* tile = nullptr;   // the home; set by open()
    std::uint64_t edges_at = 0;   // number of the first edge in the order of decoding; see holdsEdges()
    TileId home = kNoTile;        // kNoTile: not looked up yet
    std::uint32_t node = kNone;   // index in the home tile; kNone: not looked up yet
    std::uint32_t degree = 0;     // set by open()
    std::uint32_t next = kNone;   // next node in the same bucket
    std::uint32_t residency = 0;  // value of residency_ when the home was last found in memory
    std::uint32_t prepared = 0;   // last pass of prepare() that reached the node
    std::uint64_t met = 0;        // number in the order of meeting
    Label label;
  };

  // Keeps `pool` nodes, `most_labelled` nodes of a search, and `most_in_tick` nodes of a second search in the same
  // tick. Memory: 0.4 KB for each node of the pool, 0.1 KB for each other node.
  WorkingGraph(std::uint32_t pool, std::uint32_t most_labelled, std::uint32_t most_in_tick);

  // At the start of a tick. The view must stay valid until the end of the tick.
  void begin(const GraphView& view) noexcept {
    view_ = &view;
    pinned_ = search_;
    if (tiles_ == &view.tiles() && changes_ == view.tiles().changes()) return;
    tiles_ = &view.tiles();
    changes_ = view.tiles().changes();
    ++residency_;
  }
  // Drops all nodes and labels, for another graph, in which the same ids may mean other nodes. O(1).
  void forget() noexcept;

  // Removes all labels. `beside`: keep the nodes of the previous search until the tick ends, for resume(). O(1).
  void newSearch(bool beside = false) noexcept {
    ++search_;
    labelled_ = 0;
    if (!beside) pinned_ = search_;
  }
  struct Search {
    std::uint64_t number = 0;
    std::uint32_t labelled = 0;
  };
  Search search() const noexcept { return {search_, labelled_}; }
  // Continues an earlier search. The caller restores its labels with restore().
  void resume(const Search& search) noexcept {
    search_ = search.number;
    labelled_ = search.labelled;
  }

  const Node& node(std::uint32_t n) const noexcept { return nodes_[n]; }
  bool isLabelled(std::uint32_t n) const noexcept { return nodes_[n].label.search == search_; }
  // The node's label; a new one if the search has not met the node. Requires that full() is false.
  Label& label(std::uint32_t n) noexcept {
    Label& label = nodes_[n].label;
    if (label.search != search_) {
      label = Label{search_, 0, 0, false, Progress::met};
      ++labelled_;
    }
    return label;
  }
  void restore(std::uint32_t n, const Label& label) noexcept { nodes_[n].label = label; }
  bool full() const noexcept { return labelled_ >= most_labelled_; }

  // A node to meet; home and index only if known.
  struct Seen {
    NodeId id;
    Vector3d p_W;
    TileId home = kNoTile;
    std::uint32_t node = kNone;
  };
  bool isKept(std::uint32_t n, NodeId id) const noexcept {  // the node still has this local index
    return n < nodes_.size() && nodes_[n].id == id && isKept(nodes_[n]);
  }
  // The local index; kNone if the node is not kept. O(1) expected.
  std::uint32_t find(NodeId id) const noexcept;
  // The local index; adds a node that is not kept. Requires that full() is false.
  std::uint32_t meet(const Seen& seen) noexcept {
    const std::uint32_t n = find(seen.id);
    return n != kNone ? n : add(seen);
  }
  // findFar(), meetFar(): the same for the other end of an edge of `n`.
  std::uint32_t findFar(std::uint32_t n, const Edge& edge) const noexcept {
    const NodeId id = edge.farId(nodes_[n].id);
    return isKept(edge.to, id) ? edge.to : find(id);
  }
  std::uint32_t meetFar(std::uint32_t n, Edge& edge) noexcept {
    const NodeId id = edge.farId(nodes_[n].id);
    if (!isKept(edge.to, id)) edge.to = meetNew(nodes_[n], edge);
    return edge.to;
  }

  // `nowhere`: no tile is the home of the node; only in a damaged set.
  enum class Presence : std::uint8_t { present, absent, nowhere };
  // Makes tile, degree and edges of a present node available until the next open(). For an absent node, `home` is set.
  // O(1) for a decoded node.
  Presence open(std::uint32_t n) noexcept {
    const Node& node = nodes_[n];
    return node.residency == residency_ && holdsEdges(node) ? Presence::present : openSlowly(nodes_[n]);
  }
  // Edges are in the order of their ids. Valid until the next open(); for a node with more than kMostEdges segments,
  // until the next call. Requires an open node.
  Edge& edge(std::uint32_t n, std::uint32_t i) noexcept {
    Node& node = nodes_[n];
    if (node.degree <= kMostEdges) [[likely]]
      return edges_[(node.edges_at & edge_mask_) + i];
    return read(node, i);
  }
  // Prefetches the edges of the node into the processor's cache.
  void prefetch(std::uint32_t n) const noexcept {
    const Edge* edge = &edges_[nodes_[n].edges_at & edge_mask_];
    __builtin_prefetch(edge);
    __builtin_prefetch(edge + 1);
  }

  // Between ticks, while no search is unfinished: decodes nodes near the segment whose ends are `from`. Order: arc
  // length from the segment plus distance to `ahead_W`. At most `most` nodes a call and kPrepared nodes a pass. A new
  // pass begins when tiles have changed, or when the proxy or `ahead_W` has moved by a quarter of the pass's reach.
  // Absent tiles are not reported. About 0.1 us a node.
  void prepare(const GraphView& view, const Seen (&from)[2], const Vector3d& ahead_W, std::uint32_t most) noexcept;

  const GraphView& view() const noexcept { return *view_; }

 private:
  struct Bucket {
    std::uint32_t generation = 0;  // other than generation_: the bucket is empty
    std::uint32_t first = kNone;
  };
  struct Reached {  // by prepare()
    double cost;
    double arc_um;
    std::uint32_t node;
    bool operator<(const Reached& other) const noexcept { return cost > other.cost; }  // lowest cost on top
  };

  // Neighbouring samples get neighbouring buckets.
  std::size_t bucketOf(NodeId id) const noexcept { return (id.sample + id.cell * 0x9e3779b9u) & bucket_mask_; }
  bool isPinned(const Node& node) const noexcept { return node.label.search >= pinned_; }
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
  std::uint64_t changes_ = 0;  // TileTable::changes() at the last begin()
  std::uint32_t residency_ = 1;
  std::uint32_t pool_, most_labelled_, labelled_ = 0;
  std::uint64_t number_ = 0, forgotten_ = 0;  // nodes met so far; nodes met before forget()
  std::uint64_t search_ = 1, pinned_ = 1;     // nodes labelled by searches >= pinned_ are kept
  std::uint32_t generation_ = 1, slot_ = 0;   // slot_: the last slot that was filled
  std::vector<Node> nodes_;
  std::vector<Bucket> buckets_;
  std::size_t bucket_mask_;
  std::vector<Edge> edges_;  // ring buffer
  std::uint64_t edge_mask_;
  std::uint64_t edges_end_;  // edges decoded so far
  Edge scratch_{};           // the last edge read of a node with more than kMostEdges
  // prepare(): a heap of nodes to decode; number of nodes reached in this pass, and the greatest arc length.
  std::vector<Reached> reached_;
  std::uint32_t pass_ = 1, reached_count_ = 0, most_reached_;
  double reached_um_ = 0;
  std::uint32_t prepared_residency_ = 0;  // 0: no pass yet
  Vector3d from_W_ = Vector3d::Zero(), ahead_W_ = Vector3d::Zero();
};

}  // namespace filiform::internal
