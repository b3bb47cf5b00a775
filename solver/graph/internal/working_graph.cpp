#include "solver/graph/internal/working_graph.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace filiform::internal {

WorkingGraph::WorkingGraph(std::uint32_t pool, std::uint32_t most_labelled, std::uint32_t most_in_tick)
    : pool_(pool),
      most_labelled_(most_labelled),
      nodes_(std::size_t{2} * pool + most_labelled + most_in_tick + 4),
      buckets_(std::bit_ceil(2 * nodes_.size())),
      bucket_mask_(buckets_.size() - 1),
      edges_(std::bit_ceil(std::max<std::size_t>(3 * std::size_t{pool}, 4 * kMostEdges))),
      edge_mask_(edges_.size() - 1),
      edges_end_(edges_.size() + 1),
      most_reached_(std::min(kPrepared, pool / 2)) {
  reached_.reserve(most_reached_ + 2);
}

void WorkingGraph::forget() noexcept {
  ++generation_;
  number_ += pool_ + 1;
  forgotten_ = number_;
  newSearch();
  tiles_ = nullptr;
  prepared_residency_ = 0;
}

std::uint32_t WorkingGraph::find(NodeId id) const noexcept {
  const Bucket& bucket = buckets_[bucketOf(id)];
  if (bucket.generation != generation_) return kNone;
  std::uint32_t n = bucket.first;
  while (n != kNone && nodes_[n].id != id) n = nodes_[n].next;
  return n != kNone && isKept(nodes_[n]) ? n : kNone;
}

std::uint32_t WorkingGraph::add(const Seen& seen) noexcept {
  // Always finds a slot: there are more slots than pinned and prepared nodes.
  const auto inUse = [this](const Node& node) { return isPinned(node) || node.prepared == pass_; };
  do slot_ = slot_ + 1 == nodes_.size() ? 0 : slot_ + 1;
  while (inUse(nodes_[slot_]));
  Node& node = nodes_[slot_];
  if (node.met > forgotten_) remove(slot_);
  Bucket& bucket = buckets_[bucketOf(seen.id)];
  if (bucket.generation != generation_) bucket = {generation_, kNone};
  node = Node{};
  node.p_W = seen.p_W;
  node.id = seen.id;
  node.home = seen.home;
  node.node = seen.node;
  node.next = bucket.first;
  node.met = ++number_;
  bucket.first = slot_;
  return slot_;
}

void WorkingGraph::remove(std::uint32_t n) noexcept {
  std::uint32_t* at = &buckets_[bucketOf(nodes_[n].id)].first;
  while (*at != n) at = &nodes_[*at].next;
  *at = nodes_[n].next;
}

std::uint32_t WorkingGraph::meetNew(const Node& node, const Edge& edge) noexcept {
  const NodeId id = edge.farId(node.id);
  if (const std::uint32_t n = find(id); n != kNone) return n;
  const bool at_home = node.tile->isHome(edge.far);
  return add({id, edge.far_W, at_home ? node.home : kNoTile, at_home ? edge.far : kNone});
}

// A node lies exactly on its grid point, so its home follows from its position.
WorkingGraph::Presence WorkingGraph::openSlowly(Node& node) noexcept {
  if (node.home == kNoTile) node.home = view_->leaves().home(view_->grid().snap(node.p_W));
  const Tile* tile = view_->tiles().find(node.home);
  if (tile == nullptr) return node.home == kNoTile ? Presence::nowhere : Presence::absent;
  if (node.node == kNone) {
    const std::optional<std::uint32_t> found = tile->findNode(node.id);
    if (!found) return Presence::nowhere;
    node.node = *found;
  }
  node.tile = tile;
  node.residency = residency_;
  if (!holdsEdges(node)) decode(node, *tile);
  return Presence::present;
}

void WorkingGraph::decode(Node& node, const Tile& tile) noexcept {
  std::uint64_t at = edges_end_;
  if ((at & edge_mask_) + kMostEdges > edges_.size()) at = (at | edge_mask_) + 1;
  Edge* next = &edges_[at & edge_mask_];
  node.degree = tile.visitIncident(node.node, kMostEdges, [&](std::uint32_t segment, const Tile::Link& link) {
    fill(*next++, node, segment, link);
  });
  if (node.degree > kMostEdges) return;
  node.edges_at = at;
  edges_end_ = at + node.degree;
}

void WorkingGraph::fill(Edge& edge, const Node& node, std::uint32_t segment, const Tile::Link& link) const noexcept {
  edge.segment = segment;
  edge.rank = link.id.segment;
  edge.from_child = link.child == node.node;
  edge.far = edge.from_child ? link.parent : link.child;
  edge.far_rank = edge.from_child ? link.parent_id.sample : link.child_id.sample;
  edge.far_W = node.tile->position_W(edge.far);
  edge.length2 = (edge.far_W - node.p_W).squaredNorm();
  edge.length = std::sqrt(edge.length2);
  edge.to = kNone;
}

WorkingGraph::Edge& WorkingGraph::read(const Node& node, std::uint32_t i) noexcept {
  const std::uint32_t segment = node.tile->incident(node.node)[i];
  fill(scratch_, node, segment, node.tile->link(segment));
  return scratch_;
}

void WorkingGraph::prepare(const GraphView& view, const Seen (&from)[2], const Vector3d& ahead_W,
                           std::uint32_t most) noexcept {
  if (most_reached_ < 2) return;
  begin(view);
  const double moved2 = std::max((ahead_W - ahead_W_).squaredNorm(), (from[0].p_W - from_W_).squaredNorm());
  if (residency_ != prepared_residency_ || !(16 * moved2 <= reached_um_ * reached_um_)) {
    prepared_residency_ = residency_;
    ahead_W_ = ahead_W;
    from_W_ = from[0].p_W;
    ++pass_;
    reached_.clear();
    reached_count_ = 0;
    reached_um_ = 0;
    for (const Seen& end : from) reach(meet(end), 0);
  }
  for (; most > 0 && !reached_.empty(); --most) {
    std::pop_heap(reached_.begin(), reached_.end());
    const Reached next = reached_.back();
    reached_.pop_back();
    reached_um_ = std::max(reached_um_, next.arc_um);
    if (open(next.node) != Presence::present || nodes_[next.node].degree > kMostEdges) continue;
    for (std::uint32_t i = 0; i < nodes_[next.node].degree && reached_count_ < most_reached_; ++i) {
      Edge& to = edge(next.node, i);
      reach(meetFar(next.node, to), next.arc_um + to.length);
    }
  }
}

void WorkingGraph::reach(std::uint32_t n, double arc_um) noexcept {
  Node& node = nodes_[n];
  if (node.prepared == pass_) return;
  node.prepared = pass_;
  ++reached_count_;
  reached_.push_back({arc_um + (node.p_W - ahead_W_).norm(), arc_um, n});
  std::push_heap(reached_.begin(), reached_.end());
}

}  // namespace filiform::internal
