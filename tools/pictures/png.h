// Pictures as PNG. Functions without state.
#pragma once

#include "viewer/gl/renderer.h"

#include <cstdint>
#include <string>
#include <vector>

namespace filiform::tools {

struct PngOptions {
  const std::vector<std::uint8_t>* alpha = nullptr;  // of each pixel; null: opaque
  double pixel_mm = 0;                               // the width of a pixel on paper; 0: not stated
};
// Throws InputError if libpng refuses the size.
std::string pngBytes(const Picture& picture, const PngOptions& options = {});
// Writes PNG through Output (index/output.h): a file is replaced after everything is written. Throws as Output does.
void writePng(const Picture& picture, const std::string& path, const PngOptions& options = {});

}  // namespace filiform::tools
