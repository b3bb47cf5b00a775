// Pictures as PNG. Functions without state.
#pragma once

#include "viewer/gl/renderer.h"

#include <string>

namespace filiform::tools {

// Throws InputError if libpng refuses the size.
std::string pngBytes(const Picture& picture);
// Writes PNG through Output (index/output.h): a file is replaced after everything is written. Throws as Output does.
void writePng(const Picture& picture, const std::string& path);

}  // namespace filiform::tools
