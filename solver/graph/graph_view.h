// The neurites as a graph: nodes and segments across tiles, as far as the tiles are in memory.
//
// Tiles have no links to each other. A node is found through its *home*: the tile whose block contains the node and
// that stores every segment at the node. The home follows from the node's grid point alone. So a search result depends
// neither on the tiling nor on the other tiles in memory. A node is either present, with all its segments, or absent.
// For an absent node the view returns the id of the one missing tile (a *frontier*).
//
// The view owns nothing. Thread rule: belongs to the thread that owns the tile table. All members are noexcept and make
// no allocation, lock or system call.
#pragma once

#include "index/streaming/tile_table.h"
#include "index/tile/leaf_index.h"
#include "solver/graph/proxy_place.h"

namespace filiform {

class GraphView {
 public:
  // All arguments must outlive the view. All tiles of the table use `grid`.
  GraphView(const TileTable& tiles, const LeafIndex& leaves, const Grid& grid) noexcept
      : tiles_(&tiles), leaves_(&leaves), grid_(grid) {}

  const TileTable& tiles() const noexcept { return *tiles_; }
  const LeafIndex& leaves() const noexcept { return *leaves_; }
  const Grid& grid() const noexcept { return grid_; }

  // A node in its home tile.
  struct HomeNode {
    TileId home = kNoTile;       // kNoTile: no tile is the home of this node; only in a damaged set
    const Tile* tile = nullptr;  // the home tile; nullptr: not in memory
    std::uint32_t node = 0;      // index in `tile`

    bool present() const noexcept { return tile != nullptr; }
    bool frontier() const noexcept { return tile == nullptr && home != kNoTile; }
  };

  // The home of a node that `tile` stores. Does not read the home. O(1) if `tile` is the home, else O(log tiles).
  TileId homeId(const Tile& tile, std::uint32_t node) const noexcept {
    return tile.isHome(node) ? tile.id() : leaves_->home(tile.gridPoint(node));
  }
  // The node in its home tile. O(1) if `tile` is the home, else O(log tiles + log nodes of a tile).
  HomeNode home(const Tile& tile, std::uint32_t node) const noexcept;
  HomeNode home(NodeId id, const GridPoint& point) const noexcept { return nodeIn(leaves_->home(point), id); }
  // For a known home.
  HomeNode nodeIn(TileId home, NodeId id) const noexcept;

  // A segment in one of the tiles in memory.
  struct SegmentRef {
    const Tile* tile = nullptr;  // nullptr: the tile is absent or does not store the segment
    std::uint32_t segment = 0;   // index in `tile`

    explicit operator bool() const noexcept { return tile != nullptr; }
  };

  // O(log segments of a tile).
  SegmentRef segment(TileId tile, SegmentId id) const noexcept;

  // The place at parameter t (0 child .. 1 parent) of a segment, for example of a search result or a bookmark. t
  // outside 0..1 means the nearer end. At an end the place is at the node, and its tile is the node's home. Returns an
  // invalid place if the tile is absent, if it does not store the segment, or if t is NaN. O(log).
  ProxyPlace placeAt(TileId tile, SegmentId id, double t) const noexcept;
  // The same for a segment of a tile in memory. Requires 0 <= t <= 1, and p_W at t.
  ProxyPlace placeOn(const Tile& tile, std::uint32_t segment, double t, const Vector3d& p_W) const noexcept;

 private:
  const TileTable* tiles_;
  const LeafIndex* leaves_;
  Grid grid_;
};

}  // namespace filiform
