// A cell: one neuron as it was read, and the stream of cells that readers hand to the tiler. It is the only door into a
// tile set: SWC files, archive entries, synthetic columns and other graphs all come through it.
#pragma once

#include "index/grid.h"

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace filiform {

inline constexpr std::uint32_t kNoParent = UINT32_MAX;
inline constexpr float kUnknownRadius = std::numeric_limits<float>::quiet_NaN();

// Thread-compatible. Samples are in file order; a sample's *rank* is its place in these arrays, all of the same length.
struct Cell {
  std::string source;                    // path below the folder argument, archive.zip/entry, or base name; raw bytes
  std::uint64_t digest = 0;              // XXH3 of the bytes it was read from
  std::vector<std::int64_t> sample_ids;  // as in the file; may repeat only across id blocks (see block_starts)
  std::vector<Vector3d> positions_um;    // frame W, before the grid; finite, |x| <= Grid::kMaxCoordinate_um
  std::vector<std::uint32_t> parents;    // rank of the parent, kNoParent for a root; acyclic
  std::vector<float> radii_um;           // kUnknownRadius where the file held no usable one
  std::vector<std::uint16_t> types;      // SWC type codes, raw
  std::vector<std::uint32_t>
      block_starts;  // rank of the first sample of each further id block (W_ID_RESTART); empty as a rule

  std::size_t samples() const { return sample_ids.size(); }
};

class CellStream {
 public:
  virtual ~CellStream() = default;
  // Moves the next cell into `cell`, in the order that gives cell ids (source, then digest, in byte order). False at
  // the end. Throws IoError when a file that was listed can no longer be read.
  virtual bool next(Cell& cell) = 0;
};

// Names of cells for people, from their sources in the order of cell ids: base name without `.swc` and `.CNG`; where
// these are equal, the shortest suffix of the source path that tells them apart; `#2`, `#3` for equal sources. O(total
// length) expected.
std::vector<std::string> cellNames(const std::vector<std::string>& sources);

}  // namespace filiform
