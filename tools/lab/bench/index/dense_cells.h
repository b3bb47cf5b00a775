// Tissue with the density of a cortical column, for benchmarks. Morphologies of a library are turned and placed at
// random in a cube until it holds the wanted number of segments. Opposite faces of the cube are joined, so that every
// part is equally dense. The local geometry is that of the library.
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
  // The side of the cube follows from `segments` and `per_um3`. A placed cell is cut where it leaves the cube: the
  // piece beyond gets its own root and continues at the opposite face. Requires a library with segments. The library
  // must outlive the object.
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

// The reconstructions below a folder that can be packed as densely as tissue: 500 to 50 000 segments of 0.3 to 3 um on
// average, none longer than 100 um. (Two segments a um^3 are then at most 6 um of neurite a um^3, about as in cortex.)
// Returns at most `most` of them, evenly from the list. Without a folder: synthetic neurons of this seed. Throws
// UsageError if the folder has none. Exceptions of Input propagate.
std::vector<Cell> morphologyLibrary(const std::string& folder, std::size_t most, std::uint64_t seed);

}  // namespace filiform::tools
