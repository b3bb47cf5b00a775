// Does the unit of an input look right? Neurons have a scale: segments of about a micrometre, cells of tenths of a
// millimetre to centimetres. Data in nanometres or voxels that are taken for micrometres are a thousand times off.
// A doubt, never a refusal: what is tiny or huge by nature is read all the same. Thread-compatible.
#pragma once

#include "index/cell.h"

#include <string>
#include <vector>

namespace filiform {

class UnitCheck {
 public:
  // What a median cell of more than a few segments is expected to have.
  static constexpr double kMinSegment_um = 0.02, kMaxSegment_um = 200;
  static constexpr double kMinExtent_um = 1, kMaxExtent_um = 300000;
  // Coarse tracings have such segments and whole-brain axons such an extent. Both together are data in voxels.
  static constexpr double kLongSegment_um = 20, kLargeExtent_um = 20000;

  // Looks at some of the cell's segments: O(1) but for its bounds.
  void add(const Cell& cell);

  // One line that names the units that would do, the likeliest first, as --unit takes them; or empty. `unit_um` is what
  // one unit of the files was taken for. O(cells).
  std::string doubt(double unit_um = 1) const;

 private:
  static constexpr std::size_t kMaxCells = 4096, kSegmentsOfACell = 64;
  std::vector<float> extents_um_, steps_um_;  // by cell: diagonal of its bounds; median length of its segments
};

}  // namespace filiform
