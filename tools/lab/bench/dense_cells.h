// Tissue as dense as a column for benchmarks: a library of morphologies, turned and placed at random in a cube whose
// opposite faces are glued, until it holds as many segments as wanted. Every part of the cube is equally dense, and
// local geometry is that of the library.
#pragma once

#include "index/cell/cell.h"

#include <cstdint>
#include <memory>
#include <random>
#include <vector>

namespace filiform::tools {

// Thread-compatible.
class DenseCells final : public CellStream {
 public:
  // The cube has the side in which `segments` make `per_um3`. A placed cell is cut where it leaves the cube: each piece
  // goes on at the opposite face, with a root of its own. Requires a library with segments. The library must outlive
  // it.
  DenseCells(const std::vector<Cell>& library, std::uint64_t segments, double per_um3, std::uint64_t seed);

  double side_um() const { return side_um_; }
  bool next(Cell& cell) override;

 private:
  const std::vector<Cell>& library_;
  std::uint64_t left_;
  double side_um_;
  std::mt19937_64 random_;
  std::uint64_t placed_ = 0;
};

// The reconstructions below a folder that can be packed as densely as tissue is: 500 to 50 000 segments of 0.3 to 3 um
// on average, none longer than 100 um (two segments a um^3 are then at most 6 um of neurite a um^3, about what cortex
// holds); at most `most` of them, evenly from the list. Without a folder: synthetic neurons of that seed.
// Throws UsageError where the folder has none; what Input throws.
std::vector<Cell> morphologyLibrary(const std::string& folder, std::size_t most, std::uint64_t seed);

}  // namespace filiform::tools
