// The cells of an evaluation and the routes drawn on them, by a fixed rule without parameters to tune: cells in the
// order of their content digests, the last third held out; routes by a generator that uses node identities only. Thread
// rule: functions without state.
#pragma once

#include "index/cell/cell.h"

#include <cstdint>
#include <string>
#include <vector>

namespace filiform::tools {

struct DrawnRoute {
  std::uint32_t first = 0, last = 0;  // ranks of samples
  bool tip_to_tip = false;            // false: root to tip
  bool cut = false;                   // longer than longest_um: only its last part is travelled
  double length_um = 0;
  std::uint64_t key = 0;  // decides the order of a cell's routes, and seeds the tremor
};

struct RouteDraw {
  std::uint64_t seed = 1;
  int tip_to_tip = 12;       // number of routes between two tips that are drawn for each cell
  double shortest_um = 40;   // shorter routes are left out: at 1000 um across 12 cm, 40 um are 5 mm of hand movement
  double longest_um = 2000;  // only the last part of longer routes is travelled, so that no route takes minutes
};

// Returns every root-to-tip route of the cell and the tip-to-tip routes drawn, of shortest_um or more, in the order of
// their keys. Returns none for a cell with loops: off and along a route have no meaning there. Lengths are on the
// default grid. O(samples + tips * depth).
std::vector<DrawnRoute> drawRoutes(const Cell& cell, const RouteDraw& draw);

struct CorpusCell {
  Cell cell;
  bool held_out = false;
  std::vector<DrawnRoute> routes;  // the routes that are travelled
};

struct TrialCorpus {
  std::vector<CorpusCell> cells;  // cells with routes, by digest (equal digests: by source)
  std::uint64_t listed = 0;       // cells read
  std::uint64_t duplicates = 0;   // cells with the content of another cell
  std::uint64_t graphs = 0;       // cells with loops: no routes
  std::uint64_t unsuitable = 0;   // cells without a route of shortest_um
  std::uint64_t routes = 0;       // number drawn
};

// Takes `routes` routes in rounds: the first route of every cell, then the second, and so on, until there are enough or
// no more. The last round takes a part of the cells, spread evenly. Reads the stream to its end and holds it in memory.
// Exceptions of the stream propagate.
TrialCorpus drawCorpus(CellStream& stream, std::uint64_t routes, const RouteDraw& draw);

}  // namespace filiform::tools
