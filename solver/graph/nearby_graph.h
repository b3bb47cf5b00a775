// The part of the graph around a place, as a list of nodes and links, for a client that has no tiles.
//
//   NearbyGraph around(512);
//   around.collect(graph, place, 40);   // um
//   for (const auto& [a, b] : around.links()) draw(around.nodes()[a], around.nodes()[b]);
//
// Thread rule: belongs to the thread that owns the tile table.
#pragma once

#include "solver/graph/graph_view.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace filiform {

class NearbyGraph {
 public:
  using Link = std::array<std::uint16_t, 2>;  // positions in nodes()

  // The only allocation. Requires 2 <= most_nodes <= 32768.
  explicit NearbyGraph(std::uint32_t most_nodes);

  // Walks from the place along the neurites, nearest in number of links first, through nodes within `radius_um` of the
  // place and in memory. The nodes beyond the last ones are listed, their other links are not. Stops when the list is
  // full. An invalid or absent place gives nothing. O(nodes log); haptic-safe.
  void collect(const GraphView& graph, const ProxyPlace& place, double radius_um) noexcept;

  // The first two nodes are the child and the parent of the place's segment, joined by the first link. Positions in um.
  std::span<const Vector3d> nodes() const noexcept { return {positions_.data(), count_}; }
  std::span<const Link> links() const noexcept { return {links_.data(), link_count_}; }
  bool full() const noexcept { return full_; }  // the list was too short

 private:
  struct Node {
    NodeId id{UINT32_MAX, UINT32_MAX};
    GraphView::HomeNode home;
    bool expanded = false;
  };
  std::uint32_t place(NodeId id, const Tile& tile, std::uint32_t node, const GraphView& graph, bool& is_new) noexcept;
  void expand(std::uint32_t at, const GraphView& graph) noexcept;

  std::uint32_t most_, count_ = 0, link_count_ = 0;
  bool full_ = false;
  std::vector<Node> found_;
  std::vector<Vector3d> positions_;
  std::vector<Link> links_;
  std::vector<std::uint16_t> table_;  // by hash of the node: its position, or kNone
};

}  // namespace filiform
