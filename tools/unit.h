// The unit of coordinates in files, as the option --unit of several commands states it. Any thread.
#pragma once

#include "index/swc.h"

#include <string>

namespace filiform::tools {

// What --unit takes, for help texts.
inline constexpr const char* kUnitHelp = "unit of the files: um, nm, mm, 8nm, or um a voxel: one number, or X,Y,Z";

// Sets options.unit_um, or options.voxel_um where `text` gives a size for each axis. Takes um, nm, mm, a number with
// one of them behind (8nm), a number of um, or three of these as X,Y,Z. Throws UsageError for anything else.
void readUnit(const std::string& text, SwcOptions& options);

}  // namespace filiform::tools
