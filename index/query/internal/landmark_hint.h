// Estimates the nearest segments from the landmarks alone (TileStore::landmarks()), by a FLANN tree, without reading a
// tile: for approximate queries. The tree is built in memory, never loaded from a file. Thread rule: internally
// synchronised.
#pragma once

#include "index/file/internal/read_once.h"
#include "index/set/tile_store.h"

#include <memory>
#include <vector>

namespace filiform {

class LandmarkHint {
 public:
  // A landmark near the query.
  struct Guess {
    double distance;  // um, from the query to the landmark
    Vector3d p_W;     // the landmark
    SegmentId segment;
    // position on the segment: 0 child .. 1 parent
    double t;
  };

  // The store must outlive this object. O(1).
  explicit LandmarkHint(const TileStore& store);
  ~LandmarkHint();

  // The k distinct segments with the nearest landmarks, nearest first, ties by id; fewer if the landmarks hold fewer.
  // The i-th distance is at most that of the i-th nearest segment with a landmark. The first is at most the true
  // distance plus covering_radius_um(). Requires finite h_W. O(k log landmarks) expected. The first call reads the
  // landmarks and builds the tree (about 10 ms); it throws what the store throws, and the next call then tries again.
  std::vector<Guess> nearest(const Vector3d& h_W, std::size_t k) const;

  // The covering radius of the landmarks.
  double covering_radius_um() const;

 private:
  struct Impl;
  const Impl& built() const;

  const TileStore& store_;
  mutable internal::ReadOnce<Impl> built_;
};

}  // namespace filiform
