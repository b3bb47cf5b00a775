// Reads the points of --points. Functions without state.
#pragma once

#include "index/geometry/grid.h"

#include <string>
#include <vector>

namespace filiform::tools {

// Reads a file, or standard input for "-": one `x y z` a line, um, with blanks, tabs or commas between; `#` begins a
// comment. Throws IoError if it cannot be read; UsageError, which names the line, for anything else and for coordinates
// that a search refuses.
std::vector<Vector3d> readPoints(const std::string& file);

}  // namespace filiform::tools
