// Where the proxy is: the point of the neurites that the spring pulls the hand to. A plain value.
#pragma once

#include "index/tile/tile.h"

#include <cstdint>

namespace filiform {

struct ProxyPlace {
  bool at_node = false;
  SegmentId segment{UINT32_MAX, UINT32_MAX};  // at a node: one that ends there; the one from which the proxy came
  double t = 0;                               // on `segment`: 0 at its child, 1 at its parent; at a node exactly 0 or 1
  NodeId node{UINT32_MAX, UINT32_MAX};        // set only if at_node
  TileId tile = kNoTile;                      // a tile that stores `segment`; kNoTile: the place is invalid
  Vector3d p_W = Vector3d::Zero();            // the point at t on `segment`; um, frame W

  bool valid() const { return tile != kNoTile; }
};

}  // namespace filiform
