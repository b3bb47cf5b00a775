// Reads the view of --view. Thread rule: a function without state.
#pragma once

#include "viewer/scene/view_state.h"

#include <string>

namespace filiform::tools {

// Notes go to stderr. Throws IoError, and InputError for a file that is no view.
ViewState readViewFile(const std::string& path);

}  // namespace filiform::tools
