// A segment as a pass over tiles hands it out. Thread rule: a value.
#pragma once

#include "index/cell/cell.h"
#include "index/geometry/grid.h"
#include "index/tile/tile.h"

#include <cstdint>

namespace filiform {

// A segment from its child to its parent. An isolated sample is a segment whose ends are one sample.
struct PassedSegment {
  SegmentId id;
  std::uint32_t child_sample, parent_sample;  // ranks in the cell
  GridPoint child, parent;                    // TileStore::grid() converts them to um
  float radius_um = kUnknownRadius;           // of the child; unknown without appearance
  std::uint16_t type = 0;                     // of the child; 0 without appearance
};

}  // namespace filiform
