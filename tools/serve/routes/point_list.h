// The points of a JSON body. Functions without state.
#pragma once

#include "index/geometry/grid.h"

#include <cstddef>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace filiform::tools {

struct PointList {
  std::vector<Vector3d> points;
  std::map<std::string, double> numbers;  // the other members of the object
};

// Reads {"points": [[x, y, z], ...], NAME: number, ...}. Each member may occur once. Throws Refusal: 400 for anything
// else, 413 for more than `most` points. Needs no memory beyond the points. Refuses a body without points. O(bytes).
PointList readPointList(std::string_view json, std::size_t most);

}  // namespace filiform::tools
