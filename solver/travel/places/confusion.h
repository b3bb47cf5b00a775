// Estimates the largest useful zoom: the zoom at which a trembling hand still finds its own neurite rather than a
// neighbour's.
//
// At sampled places of the set, a hand holds the proxy on a neurite and trembles: the probe is off by a normally
// distributed distance on each axis of the device. The place is *confused* if the segment nearest to the probe cannot
// be reached along the neurites within four times the length of that offset. (A proxy that travels on the neurites is
// confused less often; the eye and a new jump are.) Thread rule: not for the haptic thread.
#pragma once

#include "index/query/nearest.h"
#include "index/set/tile_store.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace filiform {

struct ConfusionOptions {
  std::size_t places = 400;      // number of sampled places; the same places at every zoom
  double tremor_rms_m = 0.0005;  // on each axis of the device
  double most_confused = 0.05;   // accepted fraction of confused places
  std::uint64_t seed = 1;
};

class Confusion {
 public:
  // Chooses the places; reads the set's landmarks. Both arguments must outlive the object and be of the same set.
  Confusion(const TileStore& store, const Nearest& nearest, const ConfusionOptions& options = {});

  std::size_t places() const { return places_.size(); }

  // The fraction of places that are confused at this zoom (um of world across 0.12 m of device); 0 without places. The
  // tremor is the same at every zoom, apart from its scale. Exceptions from the store propagate. O(places log
  // segments); reads one or two tiles for each place.
  double at(double zoom_um) const;

  // The largest zoom at which at most most_confused of the places are confused, from a grid of 24 zooms a decade from 1
  // um to 100 mm; 0 if there is none. Found by bisection, which assumes that confusion only grows with the zoom. Costs
  // about 8 calls of at().
  double largestZoom() const;

 private:
  struct Place {
    SegmentId segment;
    double t;
    Vector3d p_W;     // um
    Vector3d tremor;  // of unit variance
  };
  const TileStore& store_;
  const Nearest& nearest_;
  ConfusionOptions options_;
  std::vector<Place> places_;
};

}  // namespace filiform
