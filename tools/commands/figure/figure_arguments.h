// The options of `render` for figures in papers: ground, marks, size on paper. Thread rule: values.
#pragma once

#include "viewer/scene/camera.h"
#include "viewer/scene/colour.h"

#include <string>

namespace CLI {
class App;
}

namespace filiform::tools {

struct FigureArguments {
  std::string background, title, size_mm;  // background, size_mm: empty: as --theme and --size say
  double dpi = 300;
  bool scale_bar = false, orientation = false, legend = false;

  // Throws UsageError for another ground, and for a size that cannot be read or has a side beyond `most` pixels.
  void check(int most) const;
  bool hasMarks() const { return !title.empty() || scale_bar || orientation || legend; }
  bool isClear() const { return background == "none"; }  // the ground is transparent
  Theme on(Theme theme) const;                           // the theme that fits the ground; `theme`: of --theme
  Rgba ground(Theme theme) const;                        // white, if it is transparent
  double pixel_mm() const { return size_mm.empty() ? 0 : 25.4 / dpi; }
  // In pixels; `size`: what --size says.
  PictureSize size(const std::string& size, int most) const;
};

void addFigureArguments(CLI::App& command, FigureArguments& arguments);

}  // namespace filiform::tools
