// How far a person should zoom in: where a trembling hand would still find its own neurite, and not a neighbour's.
//
// At sampled places of the set a hand holds the proxy on a neurite and trembles: the probe is off by a normal deviate
// on each axis of the device. The place is *confused* if the nearest segment to the probe is another one than the
// structure offers nearby: not within four times the tremor's length along the neurite. (A proxy that travels along the
// structure is not fooled so easily; the eye and a fresh jump are.) Not for the haptic thread.
#pragma once

#include "index/query/nearest.h"
#include "index/set/tile_store.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace filiform {

struct ConfusionOptions {
  std::size_t places = 400;      // sampled, the same for every zoom
  double tremor_rms_m = 0.0005;  // on each axis of the device
  double most_confused = 0.05;   // of the places
  std::uint64_t seed = 1;
};

class Confusion {
 public:
  // Both must outlive it, and be of the same set. Chooses the places: reads the set's samples.
  Confusion(const TileStore& store, const Nearest& nearest, const ConfusionOptions& options = {});

  std::size_t places() const { return places_.size(); }

  // The fraction of places that are confused at this zoom (um of world across 0.12 m of device); 0 without places. The
  // same tremor, scaled, at every zoom. Throws what the store throws. O(places log segments), and a tile or two a
  // place.
  double at(double zoom_um) const;

  // The largest zoom of a grid (24 a decade from 1 um to 100 mm) up to which no more than most_confused of the places
  // are confused, found by bisection as if confusion only grew with the zoom; 0 if that is so at none. About 8 at().
  double largestZoom() const;

 private:
  struct Place {
    SegmentId segment;
    double t;
    Vector3d p_W, tremor;  // um; of unit variance
  };
  const TileStore& store_;
  const Nearest& nearest_;
  ConfusionOptions options_;
  std::vector<Place> places_;
};

}  // namespace filiform
