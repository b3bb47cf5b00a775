// Figures for papers: what is written beside a picture of a scene, and scenes as vectors. Thread rule: functions
// without state.
#pragma once

#include "index/set/tile_store.h"
#include "tools/pictures/canvas.h"
#include "viewer/scene/camera.h"
#include "viewer/scene/cell_colours.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

namespace filiform::tools {

struct FigureMarks {
  std::string title{};                          // empty: none
  std::shared_ptr<const CellColours> legend{};  // null: none
  bool scale_bar = false;                       // of the plane of the focus
  bool orientation = false;                     // arrows along x, y and z
  bool on_light = false;                        // the ground
};

// Draws the marks along the rim of a picture of this view, whose focus lies `focus_um` from the eye.
void drawMarks(Canvas& canvas, const PictureSize& size, const EyeView& view, double focus_um, const FigureMarks& marks);

// What a figure takes from its scene.
struct VectorScene {
  ColourBy colour = ColourBy::cell;
  std::shared_ptr<const CellColours> cell_colours{};
  double shallow_um = 0, deep_um = 1;        // as CellPalette has them
  std::function<void(TileId done)> check{};  // before each tile; its exceptions end the drawing
};
struct VectorFigures {
  std::uint64_t segments = 0;           // drawn, at least in part in the picture
  std::uint64_t implausible_radii = 0;  // replaced ones, of all segments
};
// More segments make a document that other programs open slowly.
inline constexpr std::uint64_t kMostVectorSegments = 100'000;
// Draws all segments of the store as lines and discs of one colour each, as wide as Renderer draws them, the farthest
// first. Throws what the store throws. O(n log n).
VectorFigures drawVectors(Canvas& canvas, const PictureSize& size, const EyeView& view, const TileStore& store,
                          const VectorScene& scene);

}  // namespace filiform::tools
