// The kinds of search inside a tile. Thread rule: functions without state.
#pragma once

#include "index/errors.h"

#include <cstdint>
#include <string>

namespace filiform {

// packed: boxes of runs, the fastest. cgal: CGAL's AABB tree, the reference.
enum class TileEngineKind : std::uint8_t { packed, cgal };
// The kind with that name, as commands take it. Throws UsageError for another; the message names them.
TileEngineKind tileEngineOf(const std::string& name);

}  // namespace filiform
