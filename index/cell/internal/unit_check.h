// Checks whether the unit of an input is plausible. Neurons have a typical scale: segments of about a micrometre, cells
// of 0.1 mm to centimetres. Nanometres or voxels taken for micrometres are wrong by about a factor of 1000. The result
// is a warning, never a refusal. Thread rule: thread-compatible.
#pragma once

#include "index/cell/cell.h"

#include <string>
#include <vector>

namespace filiform {

class UnitCheck {
 public:
  // The expected range for the median cell.
  static constexpr double kMinSegment_um = 0.02, kMaxSegment_um = 200;
  static constexpr double kMinExtent_um = 1, kMaxExtent_um = 300000;
  // Coarse tracings have long segments, and whole-brain axons have a large extent. Both together indicate voxels.
  static constexpr double kLongSegment_um = 20, kLargeExtent_um = 20000;

  // Samples some segments of the cell, and its bounds. O(samples) for the bounds, O(1) for the rest.
  void add(const Cell& cell);

  struct Sizes {  // of a cell: diagonal of its bounds, median length of its segments
    float extent_um, step_um;
  };
  // What was added, in its order: another process can add it to its own check.
  const std::vector<Sizes>& sizes() const { return sizes_; }
  void add(const Sizes& cell);

  // Returns one line that names plausible units, the likeliest first, in the syntax of --unit. Returns an empty text if
  // the unit is plausible. `unit_um`: the size assumed for one unit of the files, um. A value other than 1 was stated
  // by the user: long segments of a large cell are then plausible. O(cells).
  std::string doubt(double unit_um = 1) const;

 private:
  static constexpr std::size_t kMaxCells = 4096, kSegmentsOfACell = 64;
  std::vector<Sizes> sizes_;
};

}  // namespace filiform
