// ContactSite: a place where two cells come close. contacts.h defines it. Thread rule: a value.
#pragma once

#include "index/geometry/grid.h"

#include <array>
#include <cstdint>

namespace filiform {

struct ContactSite {
  struct Side {
    std::uint32_t cell = 0, segment = 0, child = 0, parent = 0;  // of the closest place; ranks
    std::uint16_t type = 0;                                      // of that segment
    double t = 0;                                                // on it: 0 child .. 1 parent
    double length_um = 0;                                        // of all segments of the site, each once
    // Only with places:
    Vector3d p_W = Vector3d::Zero();  // on the axis
    std::int64_t sample_id = 0;       // of the child
    double path_um = 0;  // along the cell, to its first sample of type 1; NaN if it has none, or no path leads there
  };
  std::array<Side, 2> sides;  // of `from`, of `to`
  double distance_um = 0;     // the smallest of the pairs; below 0 where surfaces overlap
  std::uint64_t pairs = 0;
};

}  // namespace filiform
