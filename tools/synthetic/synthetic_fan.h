// A fan: branches that leave one node nearly parallel, with the wanted branch in the middle and two sharp elbows after.
// The paper's Figure 3 names this shape as the reason for its force-based method: the Voronoi region of the middle
// branch is narrow. Functions without state; the same arguments give the same bytes on every machine.
#pragma once

#include "index/cell/cell.h"
#include "tools/synthetic/synthetic_neuron.h"

#include <cstdint>
#include <string>

namespace filiform::tools {

struct FanOptions {
  int branches = 7;        // the wanted one included; >= 2
  double cone_rad = 0.2;   // angle between the wanted branch and each other branch; 0 .. pi / 2
  double segment_um = 10;  // about the length of every segment
  bool alike = false;      // the other branches have two sharp elbows too; false: they are straight
  std::uint64_t seed = 1;  // of the direction, lengths, elbows and the order of the branches
};

struct Fan {
  Neuron neuron;
  Cell cell;                          // its source contains "fan"
  std::string text;                   // SWC of the cell
  std::uint32_t first = 0, last = 0;  // the route: ranks of its first sample (the root) and its last (a tip)
};

// A stem of 60 um, then `branches` branches. The wanted one continues the stem for 30 to 50 um, turns by 1.7 to 2.2
// rad, runs 30 to 50 um, turns back, and runs 30 to 50 um. The others begin evenly round the wanted branch (up to a
// quarter of a step aside); they are straight and 60 to 100 um long, or `alike`. The fan is turned at random. Throws
// UsageError for options outside their ranges. O(samples).
Fan buildFan(const FanOptions& options);

// The options of fan `number` of a family: cone_rad evenly in .05 to .6, segment_um evenly in 2 to 30; odd numbers are
// alike.
FanOptions drawFan(std::uint64_t seed, std::uint64_t number, int branches);

}  // namespace filiform::tools
