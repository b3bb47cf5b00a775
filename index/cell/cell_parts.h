// The cells of a file that holds several. Thread rule: a pure function.
//
//   for (const Cell& cell : cellPartsOf(whole).cells) std::cout << cell.name << '\n';
//
// A cell is all trees whose somata touch each other, if at least one of them has a neurite: many tracers draw one soma
// as several spheres. The other trees, and somata alone, are loose.
#pragma once

#include "index/cell/cell.h"

#include <cstddef>
#include <vector>

namespace filiform {

// With more samples of somata, the file counts as one cell: it holds something other than cells.
inline constexpr std::size_t kMostSamplesOfSomata = 10'000;

struct CellParts {
  // Empty if the file is one cell. Otherwise its cells, in the order of their first samples, and last the loose trees,
  // if there are any, as one.
  std::vector<Cell> cells;
  std::size_t loose_trees = 0;
};

// The parts have their samples in the order of the file. Their names are that of `whole`, or what its source gives, and
// /1, /2 and so on, or /loose. Everything else, such as the header, stays with `whole`: a file may have 5000 cells.
// O(samples) for one tree; otherwise O(samples log samples), and the square of the samples of somata if all overlap in
// x.
CellParts cellPartsOf(const Cell& whole);

}  // namespace filiform
