// Reads what an SWC comment line states about coordinates. Thread rule: pure functions, any thread.
#pragma once

#include "index/geometry/grid.h"

#include <optional>
#include <string_view>

namespace filiform::internal {

struct HeaderLine {
  std::optional<Vector3d> scale;   // `# SCALE a b c`, or one number for all axes
  std::optional<Vector3d> offset;  // `# OFFSET x y z`
  std::string_view foreign_unit;   // "pixels" of `# coordinate: pixels`; usually empty
  bool in_um = false;              // states micrometres: `# unit: um`, `# in micrometers; xyz = voxel * size`
};

// Requires that `comment` starts at its `#`. Words match in any letter case. O(length).
HeaderLine readHeaderLine(std::string_view comment);

}  // namespace filiform::internal
