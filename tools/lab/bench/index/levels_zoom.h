// A zoom from a whole set to one neurite, drawn with levels of detail and beside it with every segment. It counts how
// coverage and brightness change from step to step.
#pragma once

#include "index/levels/levels.h"
#include "index/set/tile_set.h"
#include "tools/lab/bench/bench.h"

#include <functional>
#include <string>

namespace filiform::tools {

// Draws ten steps to the segment nearest to the middle of the set, and adds a table and two bounds to the report.
// `segments`: most segments of a picture. Throws GraphicsError without OpenGL 3.3. O(steps * segments of the set).
void measureZoom(const TileSet& set, const Levels& levels, std::uint64_t segments, bool quick,
                 const std::function<void(const std::string&)>& progress, BenchReport& report);

}  // namespace filiform::tools
