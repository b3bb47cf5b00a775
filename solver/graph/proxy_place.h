// The proxy's place: at a node, or on a segment. A plain value.
#pragma once

#include "index/tile/tile.h"

#include <cstdint>

namespace filiform {

struct ProxyPlace {
  bool at_node = false;
  SegmentId segment{UINT32_MAX, UINT32_MAX};  // at a node: the segment from which the proxy came
  double t = 0;                               // on `segment`: 0 child .. 1 parent; exactly 0 or 1 at a node
  NodeId node{UINT32_MAX, UINT32_MAX};        // at_node only
  TileId tile = kNoTile;                      // a tile that stores `segment`; kNoTile: the place is invalid
  Vector3d p_W = Vector3d::Zero();            // um

  bool valid() const { return tile != kNoTile; }
};

}  // namespace filiform
