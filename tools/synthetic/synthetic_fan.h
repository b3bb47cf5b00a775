// A fan: branches that leave one node nearly parallel. The wanted branch is in the middle and then has two sharp
// elbows. The paper's Figure 3 gives this shape as the reason for the force-based method: the Voronoi region of the
// middle branch is narrow. Functions without state; the same arguments give the same bytes on every machine.
#pragma once

#include "index/cell/cell.h"
#include "tools/synthetic/synthetic_neuron.h"

#include <cstdint>
#include <string>

namespace filiform::tools {

struct FanOptions {
  int branches = 7;        // the wanted one included; >= 2
  double cone_rad = 0.2;   // angle between the wanted branch and each other branch; 0 .. pi / 2
  double segment_um = 10;  // approximate length of every segment
  bool alike = false;      // true: the other branches also have two sharp elbows; false: they are straight
  std::uint64_t seed = 1;  // for the direction, lengths, elbows and the order of the branches
};

struct Fan {
  Neuron neuron;
  Cell cell;                          // its source contains "fan"
  std::string text;                   // SWC of the cell
  std::uint32_t first = 0, last = 0;  // the route: ranks of its first sample (the root) and its last sample (a tip)
};

// Builds a stem of 60 um, then `branches` branches. The wanted branch continues the stem for 30 to 50 um, turns by 1.7
// to 2.2 rad, runs 30 to 50 um, turns back, and runs 30 to 50 um. The other branches are evenly distributed around the
// wanted one (up to a quarter of a step aside); they are straight and 60 to 100 um long, or `alike`. The fan is turned
// at random. Throws UsageError for options outside their ranges. O(samples).
Fan buildFan(const FanOptions& options);

// The options of fan `number` of a family: cone_rad uniform in .05 to .6, segment_um uniform in 2 to 30. Fans with odd
// numbers are alike.
FanOptions drawFan(std::uint64_t seed, std::uint64_t number, int branches);

}  // namespace filiform::tools
