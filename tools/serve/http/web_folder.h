// Finds the files of the page for travel, which the preset `web` makes. Thread rule: function without state.
#pragma once

#include <string>

namespace filiform::tools {

// The folder of the variable FILIFORM_WEB; else ../share/filiform/web beside the program, or ../web/page, where a build
// of the preset lies beside the program's. Empty if none of them has the files.
std::string findWebFolder();

}  // namespace filiform::tools
