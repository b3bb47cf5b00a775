// What a comment line of an SWC file says about its coordinates. Pure functions, any thread.
#pragma once

#include "index/grid.h"

#include <optional>
#include <string_view>

namespace filiform::internal {

struct HeaderLine {
  std::optional<Vector3d> scale;   // `# SCALE a b c`, or one number for all three
  std::optional<Vector3d> offset;  // `# OFFSET x y z`
  std::string_view foreign_unit;   // "pixels" of `# coordinate: pixels`; empty as a rule
};

// `comment` starts at its `#`. Words are matched in any letter case. O(length).
HeaderLine readHeaderLine(std::string_view comment);

}  // namespace filiform::internal
