// The graph as the solver walks it: nodes and segments across tiles, as far as the tiles are resident.
//
// There are no links between tiles. A node is entered through its *home*, the tile whose cell contains it, which holds
// every segment at it; the home follows from the node's grid point alone. So what is found depends neither on the
// tiling nor on which other tiles happen to be resident: a node is either present, with all its segments, or absent,
// with the id of the one tile that is missing (a *frontier*).
//
// A view does not own what it shows. Thread rule: belongs to the thread that owns the tile table. Every member is
// noexcept and works without allocation, lock or system call.
#pragma once

#include "index/streaming/tile_table.h"
#include "index/tile/leaf_index.h"
#include "solver/graph/proxy_place.h"

namespace filiform {

class GraphView {
 public:
  // All three must outlive the view; the grid is that of every tile in the table.
  GraphView(const TileTable& tiles, const LeafIndex& leaves, const Grid& grid) noexcept
      : tiles_(&tiles), leaves_(&leaves), grid_(grid) {}

  const TileTable& tiles() const noexcept { return *tiles_; }
  const LeafIndex& leaves() const noexcept { return *leaves_; }
  const Grid& grid() const noexcept { return grid_; }

  struct HomeNode {
    TileId home = kNoTile;       // kNoTile: no tile is home to it, so nothing follows (never so in a sound set)
    const Tile* tile = nullptr;  // the home tile if it is resident
    std::uint32_t node = 0;      // in `tile`

    bool present() const noexcept { return tile != nullptr; }
    bool frontier() const noexcept { return tile == nullptr && home != kNoTile; }
  };

  // Home of a node that is stored in `tile`, without reading the home itself. O(1) if it is `tile`, else O(log tiles).
  TileId homeId(const Tile& tile, std::uint32_t node) const noexcept {
    return tile.isHome(node) ? tile.id() : leaves_->home(tile.gridPoint(node));
  }
  // The node in its home tile. O(1) from the home tile itself, else O(log tiles + log nodes of a tile).
  HomeNode home(const Tile& tile, std::uint32_t node) const noexcept;
  HomeNode home(NodeId id, const GridPoint& point) const noexcept { return nodeIn(leaves_->home(point), id); }
  HomeNode nodeIn(TileId home, NodeId id) const noexcept;  // where the home is known already

  struct SegmentRef {
    const Tile* tile = nullptr;  // nullptr: the tile is absent or does not store the segment
    std::uint32_t segment = 0;   // in `tile`

    explicit operator bool() const noexcept { return tile != nullptr; }
  };

  // O(log segments of a tile).
  SegmentRef segment(TileId tile, SegmentId id) const noexcept;

  // The place at parameter t (0 child .. 1 parent) of a segment: what a nearest-segment query answered, or a bookmark.
  // Values of t outside 0..1 mean the ends; at an end the place is at the node, and its tile is the node's home. An
  // invalid place if the tile is absent, does not store the segment, or t is NaN. O(log).
  ProxyPlace placeAt(TileId tile, SegmentId id, double t) const noexcept;
  // The same for a segment in hand; Requires 0 <= t <= 1 and p_W the point at t.
  ProxyPlace placeOn(const Tile& tile, std::uint32_t segment, double t, const Vector3d& p_W) const noexcept;

 private:
  const TileTable* tiles_;
  const LeafIndex* leaves_;
  Grid grid_;
};

}  // namespace filiform
