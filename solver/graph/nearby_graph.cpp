#include "solver/graph/nearby_graph.h"

#include <algorithm>
#include <bit>

namespace filiform {

namespace {

constexpr std::uint16_t kNotListed = UINT16_MAX;
constexpr std::uint32_t kMostBranches = 64;  // of a node; the segments of larger hubs are left out

}  // namespace

NearbyGraph::NearbyGraph(std::uint32_t most_nodes)
    : most_(std::clamp<std::uint32_t>(most_nodes, 2, 32768)),
      found_(most_),
      positions_(most_),
      links_(2 * static_cast<std::size_t>(most_)),
      table_(std::bit_ceil(2 * static_cast<std::size_t>(most_)), kNotListed) {}

std::uint32_t NearbyGraph::place(NodeId id, const Tile& tile, std::uint32_t node, const GraphView& graph,
                                 bool& is_new) noexcept {
  is_new = false;
  std::size_t slot = (id.key() * 0x9E3779B97F4A7C15ull >> 32) & (table_.size() - 1);
  for (; table_[slot] != kNotListed; slot = (slot + 1) & (table_.size() - 1))
    if (found_[table_[slot]].id == id) return table_[slot];
  if (count_ == most_) {
    full_ = true;
    return most_;
  }
  is_new = true;
  table_[slot] = static_cast<std::uint16_t>(count_);
  found_[count_] = {id, graph.home(tile, node), false};
  positions_[count_] = tile.position_W(node);
  return count_++;
}

void NearbyGraph::expand(std::uint32_t at, const GraphView& graph) noexcept {
  const GraphView::HomeNode home = found_[at].home;
  if (!home.present()) return;
  found_[at].expanded = true;
  const std::uint32_t branches =
      home.tile->visitIncident(home.node, kMostBranches, [&](std::uint32_t, const Tile::Link& link) {
        const bool at_child = link.child_id == found_[at].id;
        const NodeId other_id = at_child ? link.parent_id : link.child_id;
        bool is_new = false;
        const std::uint32_t other = place(other_id, *home.tile, at_child ? link.parent : link.child, graph, is_new);
        if (other == most_ || other == at || (!is_new && found_[other].expanded)) return;
        if (link_count_ == links_.size()) {
          full_ = true;
          return;
        }
        // The segment of the place is the first link already.
        if (at < 2 && other < 2 && link_count_ > 0) return;
        links_[link_count_++] = {static_cast<std::uint16_t>(at), static_cast<std::uint16_t>(other)};
      });
  full_ = full_ || branches > kMostBranches;
}

void NearbyGraph::collect(const GraphView& graph, const ProxyPlace& place_W, double radius_um) noexcept {
  count_ = link_count_ = 0;
  full_ = false;
  std::fill(table_.begin(), table_.end(), kNotListed);
  const Tile* const tile = place_W.valid() ? graph.tiles().find(place_W.tile) : nullptr;
  const GraphView::SegmentRef segment =
      tile != nullptr ? graph.segment(place_W.tile, place_W.segment) : GraphView::SegmentRef{};
  if (!segment) return;
  const Tile::Link link = segment.tile->link(segment.segment);
  bool is_new = false;
  place(link.child_id, *segment.tile, link.child, graph, is_new);
  place(link.parent_id, *segment.tile, link.parent, graph, is_new);
  if (count_ == 2) links_[link_count_++] = {0, 1};
  for (std::uint32_t at = 0; at < count_; ++at)
    if (at < 2 || (positions_[at] - place_W.p_W).norm() <= radius_um) expand(at, graph);
}

}  // namespace filiform
