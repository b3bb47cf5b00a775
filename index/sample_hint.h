// A guess at the nearest segments from the data set's samples alone, without reading a tile: FLANN over
// TileStore::samples(). It bounds the exact search, and is the approximate jump. Built in memory, never loaded from a
// file. Thread rule: internally synchronised.
#pragma once

#include "index/tile_store.h"

#include <memory>
#include <vector>

namespace filiform {

class SampleHint {
 public:
  struct Guess {
    double distance;  // um, from the query to the sample
    Vector3d p_W;     // the sample
    SegmentId segment;
    double t;
  };

  // The store must outlive it. O(1).
  explicit SampleHint(const TileStore& store);
  ~SampleHint();

  // The k distinct segments whose samples are nearest, nearest first, ties by id; fewer where the samples hold fewer.
  // The i-th distance is at most that of the i-th nearest segment with a sample, and the first is at most the true
  // distance plus covering_radius_um(). Requires finite h. O(k log samples) expected; the first call reads the samples
  // and builds the tree (about 10 ms).
  std::vector<Guess> nearest(const Vector3d& h_W, std::size_t k) const;

  // A squared distance, um^2, within which k distinct segments surely lie, rounding included; infinity where the
  // samples do not tell cheaply. The first few calls answer infinity, if the tree is not there
  // yet: a first jump does not wait for it.
  double squaredBound(const Vector3d& h_W, std::size_t k) const;

  double covering_radius_um() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform
