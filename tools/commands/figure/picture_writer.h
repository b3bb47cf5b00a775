// Writes a picture of a scene as PNG, SVG or PDF, with its marks. Thread rule: the thread of the renderer's context.
#pragma once

#include "tools/commands/figure/figure_arguments.h"
#include "tools/pictures/canvas.h"
#include "viewer/gl/scene_view.h"

#include <optional>
#include <string>

namespace filiform::tools {

struct PictureOutput {
  std::string out;
  FigureArguments figure;
  Theme theme = Theme::dark;
  bool with_legend = true;  // of the frame's colours of cells
};

// The format that a name ends in; nullopt: PNG.
std::optional<VectorFormat> vectorFormatOf(const std::string& out);

// Draws the frame, and writes it as the output's name says: SVG and PDF as lines, or, of a store with more than
// kMostVectorSegments, as a picture in the page, which a note says. Throws as SceneView::drawWhole() and Output do.
SceneFigures writePicture(SceneFrame& frame, const PictureOutput& output, const TileStore& store, SceneView& scene,
                          Renderer& renderer);

}  // namespace filiform::tools
