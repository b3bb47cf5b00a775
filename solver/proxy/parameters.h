// Automatic parameters of the force-based solver (DESIGN 5.5): the reach r = min(r_max, G |q-h| + r_min) from the data.
//
// The paper takes r_min and r_max as the shortest and longest segment of the data; one segment of 700 um among millions
// of 2 um would then set r_max. Here they are the 5th and the 95th percentile of a cell's non-zero segment lengths, and
// G is 1. Not for the haptic thread.
#pragma once

#include "index/cell/cell.h"
#include "index/set/tile_store.h"
#include "solver/proxy/proxy_solver.h"

#include <cstdint>
#include <vector>

namespace filiform {

// From lengths in um; zero lengths do not count. Percentiles by nearest rank: both are lengths of the data. Without a
// non-zero length r_min = r_max = 0. All else is the default. Requires finite lengths. O(n).
SolverParameters automaticParameters(std::vector<double> lengths_um);
// From the links of a cell, positions rounded to the grid: the same lengths as in tiles.
SolverParameters automaticParameters(const Cell& cell, const Grid& grid);
// From the owned segments of a cell in a set; reads each of its tiles once. Throws CorruptSet, CorruptTile, IoError.
SolverParameters automaticParameters(const TileStore& store, std::uint32_t cell);

}  // namespace filiform
