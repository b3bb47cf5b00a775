// Automatic parameters of the force-based solver: the reach r = min(r_max, G |q-h| + r_min) from the data.
//
// The paper takes r_min and r_max from the shortest and longest segment of the data. One segment of 700 um among
// millions of 2 um would then set r_max. Here r_min and r_max are the 5th and the 95th percentile of the cell's
// non-zero segment lengths, and G is 1. Thread rule: functions without state; not for the haptic thread.
#pragma once

#include "index/cell/cell.h"
#include "index/set/tile_store.h"
#include "solver/proxy/proxy_solver.h"

#include <atomic>
#include <cstdint>
#include <vector>

namespace filiform {

// From lengths (um); zero lengths do not count. Percentiles are by nearest rank, so both are lengths of the data.
// Without a non-zero length, r_min = r_max = 0. Other parameters have their defaults. Requires finite lengths. O(n).
SolverParameters automaticParameters(std::vector<double> lengths_um);
// From the links of a cell, with positions rounded to the grid. Gives the same lengths as the tiles.
SolverParameters automaticParameters(const Cell& cell, const Grid& grid);
// From the owned segments of a cell in a set. Reads each tile of the cell once. Throws CorruptSet, CorruptTile,
// IoError; Interrupted before the next tile once `stop` is true.
SolverParameters automaticParameters(const TileStore& store, std::uint32_t cell,
                                     const std::atomic<bool>* stop = nullptr);

}  // namespace filiform
