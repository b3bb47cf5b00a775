// The distance of one trace of a neuron from another: how much of its length lies within a distance of the other, and
// how far it is from it. It has a direction: a short trace may lie within a long one, but not the other way round.
//
//   const TraceDistance d = traceDistance(first, second, {.within_um = 2});
//   std::cout << d.within_length_um / d.length_um << " of the first lies within 2 um of the second\n";
//
// Traces are their segments, without radii, those between samples of a soma included. Thread rule: pure function.
#pragma once

#include "index/query/cell_graph.h"

#include <cstdint>
#include <functional>

namespace filiform {

struct TraceDistanceOptions {
  double within_um = 2;                 // above 0
  std::uint64_t most_places = 1 << 20;  // bounds time and memory: 16 bytes a place
  std::function<void()> check{};        // called now and then; its exceptions propagate
};

struct TraceDistance {
  double length_um = 0;  // of the trace
  // The length whose points lie within `within_um` of the other trace, the distance included. Exact up to rounding:
  // segments are split where they enter and leave.
  double within_length_um = 0;
  // Of the distances of all points of the trace to the other, by length. They are measured at the middles of pieces of
  // at most step_um; `max_um` also at all samples. As no distance changes faster than the length along the trace, each
  // is off by at most step_um / 2. NaN if the trace has no length.
  double mean_um, median_um, max_um;
  double step_um = 0;  // within_um / 20; longer for traces of more than `most_places` such pieces
};

// Requires that `to` has a sample, and finite within_um > 0. O((places + segments of `from`) log segments of `to`)
// expected.
TraceDistance traceDistance(const CellGraph& from, const CellGraph& to, const TraceDistanceOptions& options = {});

}  // namespace filiform
