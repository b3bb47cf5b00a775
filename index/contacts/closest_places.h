// The closest places of two segments. These functions alone decide what is a contact: in double, of exact positions,
// without libm beyond sqrt. So all processors, tilings and numbers of threads agree to the last bit. Boxes may exclude
// pairs but never decide. Thread rule: pure functions.
#pragma once

#include "index/geometry/grid.h"

#include <array>

namespace filiform {

// A segment; with radii, the round cone about it: the hull of two balls.
struct SegmentEnds {
  Vector3d child_W, parent_W;
  double child_radius_um = 0, parent_radius_um = 0;

  // Exactly an end if t is 0 (child) or 1 (parent).
  Vector3d at(double t) const {
    if (t == 0) return child_W;
    if (t == 1) return parent_W;
    return child_W + t * (parent_W - child_W);
  }
  double radiusAt_um(double t) const {
    if (t == 0) return child_radius_um;
    if (t == 1) return parent_radius_um;
    return child_radius_um + t * (parent_radius_um - child_radius_um);
  }
};

struct ClosestPlaces {
  std::array<double, 2> t;  // on each segment: 0 at the child, 1 at the parent
  double distance_um;       // between the axes; of surfaces: below 0 where the cones overlap
};

// The closest places of the two axes. Of equally close places, as on parallels: an end of the first segment, then of
// the second, children first. Swapping the segments may change the last bit. Requires finite positions. O(1).
ClosestPlaces closestOnAxes(const SegmentEnds& a, const SegmentEnds& b);

// The places on the two axes where |p - q| - r(p) - r(q) is least. Radii are at least 0 and finite; else as above.
ClosestPlaces closestOnSurfaces(const SegmentEnds& a, const SegmentEnds& b);

}  // namespace filiform
