// The cells of an evaluation and the routes drawn on them, by a fixed rule that nobody can tune: cells in the order of
// the digest of their content, the last third held out; routes from a generator that knows node identities only. Thread
// rule: functions without state.
#pragma once

#include "index/cell/cell.h"

#include <cstdint>
#include <string>
#include <vector>

namespace filiform::tools {

struct DrawnRoute {
  std::uint32_t first = 0, last = 0;  // ranks of samples
  bool tip_to_tip = false;            // else root to tip
  bool cut = false;                   // longer than longest_um: only its last part is travelled
  double length_um = 0;
  std::uint64_t key = 0;  // decides the order of a cell's routes, and the seed of the tremor
};

struct RouteDraw {
  std::uint64_t seed = 1;
  int tip_to_tip = 12;       // routes between two tips that are drawn a cell
  double shortest_um = 40;   // shorter routes are left out: at 1000 um across 12 cm, 5 mm of hand movement
  double longest_um = 2000;  // of longer ones the last part is travelled, so that no route takes minutes
};

// None for a cell with loops, where off and along a route have no meaning. Else every root-to-tip route of the cell and
// the tip-to-tip ones drawn, of shortest_um or more, in the order of their keys. Lengths are those on the default grid.
// O(samples + tips * depth).
std::vector<DrawnRoute> drawRoutes(const Cell& cell, const RouteDraw& draw);

struct CorpusCell {
  Cell cell;
  bool held_out = false;
  std::vector<DrawnRoute> routes;  // those that are travelled
};

struct TrialCorpus {
  std::vector<CorpusCell> cells;  // those with routes, by digest (equal ones: by source)
  std::uint64_t listed = 0;       // cells read
  std::uint64_t duplicates = 0;   // of them, with the content of another
  std::uint64_t graphs = 0;       // of them, with loops: no routes
  std::uint64_t unsuitable = 0;   // of them, without a route of shortest_um
  std::uint64_t routes = 0;       // drawn
};

// Takes `routes` routes in rounds: the first of every cell, then the second, until there are enough (of the last round
// a part, spread evenly over the cells) or no more. Reads the stream to its end and holds it in memory. Throws what the
// stream throws.
TrialCorpus drawCorpus(CellStream& stream, std::uint64_t routes, const RouteDraw& draw);

}  // namespace filiform::tools
