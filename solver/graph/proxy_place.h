// Where the proxy is: at a node, or somewhere on a segment. A plain value.
#pragma once

#include "index/tile/tile.h"

#include <cstdint>

namespace filiform {

struct ProxyPlace {  // a point of the structure
  bool at_node = false;
  SegmentId segment{UINT32_MAX, UINT32_MAX};  // the active segment; at a node: the segment by which it was reached
  double t = 0;                               // on that segment: 0 child .. 1 parent; exactly 0 or 1 at a node
  NodeId node{UINT32_MAX, UINT32_MAX};        // at_node only
  TileId tile = kNoTile;                      // a tile that stores the segment
  Vector3d p_W = Vector3d::Zero();            // um

  bool valid() const { return tile != kNoTile; }
};

}  // namespace filiform
