// Reads the points of --points. Functions without state.
#pragma once

#include "index/geometry/grid.h"

#include <string>
#include <vector>

namespace filiform::tools {

// Three numbers as a point. Throws UsageError, which names the first that is no number: `before`, then x, y or z.
// Requires three words.
Vector3d pointOfWords(const std::vector<std::string>& words, const std::string& before = {});

// Reads a file, or standard input for "-": one `x y z` a line, um, with blanks, tabs or commas between; `#` begins a
// comment; a byte-order mark is passed over. Throws IoError if it cannot be read; UsageError, which names the line, for
// anything else and for coordinates that a search refuses.
std::vector<Vector3d> readPoints(const std::string& file);

}  // namespace filiform::tools
