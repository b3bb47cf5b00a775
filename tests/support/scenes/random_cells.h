// Cells for tests: seeded random neurons, and extreme cells.
#pragma once

#include "index/cell/cell.h"

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace filiform::test {

// Adds a sample; returns its rank. Ids run from 1.
std::uint32_t addSample(Cell& cell, const Vector3d& p_W, std::uint32_t parent = kNoParent, float radius_um = 0.5f,
                        std::uint16_t type = 3);

struct NeuronShape {
  std::uint32_t samples = 500;
  double step_um = 3.0;         // mean segment length
  double branching = 0.03;      // chance that a sample starts a new branch from an earlier sample
  double extra_root = 0.002;    // chance that a sample starts a new tree
  bool shuffled_files = false;  // some parents come after their children; ids have gaps
  Vector3d origin_W = Vector3d::Zero();
};
Cell randomNeuron(std::uint64_t seed, const NeuronShape& shape = {});

// Neurons spread over a cube of `extent_um`, with sources in ascending order.
std::vector<Cell> randomColumn(std::uint64_t seed, std::uint32_t cells, std::uint32_t samples_each, double extent_um);

// A cell with steps of 1 um about the origin, and a smaller one with steps of 12 um about kCoarse_W.
inline const Vector3d kCoarse_W{5000, 0, 0};
std::vector<Cell> fineAndCoarse();

Cell isolatedNodes(std::uint64_t seed, std::uint32_t n, double extent_um);
Cell coincidentNodes(std::uint32_t n);                    // n connected nodes at one place
Cell hub(std::uint32_t branches, double length_um);       // one node with many branches, in all directions
Cell comb(std::uint32_t teeth);                           // a spine with a twig at every node
Cell longNeurite(std::uint32_t samples, double step_um);  // unbranched

struct NamedCells {
  std::string name;
  std::vector<Cell> cells;
};
// A small cell of every generator above, and: nothing, a cell without samples, one node, one segment, zero-length
// segments, a segment that crosses hundreds of leaves, structures far from the origin and at the edge of the grid,
// one outlier at 1e9 um, all cells within one voxel, equal cells twice, a restarted id block.
std::vector<NamedCells> worstCases();

}  // namespace filiform::test
