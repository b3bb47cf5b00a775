#include "solver/graph/graph_view.h"

namespace filiform {

GraphView::HomeNode GraphView::home(const Tile& tile, std::uint32_t node) const noexcept {
  if (tile.isHome(node)) return {tile.id(), &tile, node};
  return nodeIn(leaves_->home(tile.gridPoint(node)), tile.nodeId(node));
}

GraphView::HomeNode GraphView::nodeIn(TileId home, NodeId id) const noexcept {
  const Tile* tile = tiles_->find(home);
  if (tile == nullptr) return {home, nullptr, 0};
  const std::optional<std::uint32_t> node = tile->findNode(id);
  // Not a frontier: the caller would ask for the tile again and again.
  if (!node) return {};
  return {home, tile, *node};
}

GraphView::SegmentRef GraphView::segment(TileId tile, SegmentId id) const noexcept {
  const Tile* stored = tiles_->find(tile);
  if (stored == nullptr) return {};
  const std::optional<std::uint32_t> segment = stored->findSegment(id);
  if (!segment) return {};
  return {stored, *segment};
}

ProxyPlace GraphView::placeAt(TileId tile, SegmentId id, double t) const noexcept {
  const SegmentRef found = segment(tile, id);
  if (!found || t != t) return {};
  const Vector3d child_W = found.tile->position_W(found.tile->child(found.segment));
  const Vector3d parent_W = found.tile->position_W(found.tile->parent(found.segment));
  if (!(t > 0.0)) return placeOn(*found.tile, found.segment, 0.0, child_W);
  if (t >= 1.0) return placeOn(*found.tile, found.segment, 1.0, parent_W);
  // A segment of length zero has no interior.
  if (child_W == parent_W) return placeOn(*found.tile, found.segment, 0.0, child_W);
  return placeOn(*found.tile, found.segment, t, child_W + t * (parent_W - child_W));
}

ProxyPlace GraphView::placeOn(const Tile& tile, std::uint32_t segment, double t, const Vector3d& p_W) const noexcept {
  ProxyPlace place;
  const Tile::Link link = tile.link(segment);
  place.segment = link.id;
  place.t = t;
  place.p_W = p_W;
  place.at_node = t == 0.0 || t == 1.0;
  if (place.at_node) {
    place.node = t == 0.0 ? link.child_id : link.parent_id;
    place.tile = homeId(tile, t == 0.0 ? link.child : link.parent);
    if (place.tile == kNoTile) place.tile = tile.id();
  } else {
    place.tile = tile.id();
  }
  return place;
}

}  // namespace filiform
