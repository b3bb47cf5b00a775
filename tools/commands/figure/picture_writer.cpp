#include "tools/commands/figure/picture_writer.h"

#include "index/count_text.h"
#include "index/output.h"
#include "index/text.h"
#include "tools/pictures/figure.h"
#include "tools/pictures/png.h"
#include "tools/program/interruption.h"
#include "tools/program/progress.h"

#include <algorithm>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

namespace filiform::tools {
namespace {

// Draws one picture, and writes it as the output's name says.
struct PictureWriter {
  const PictureOutput& a;
  const TileStore& store;
  SceneView& scene;
  Renderer& renderer;

  SceneFigures write(SceneFrame& frame) const {
    const auto format = vectorFormatOf(a.out);
    if (format) return writeVectors(*format, frame);
    SceneFigures figures;
    Picture picture = drawn(frame, figures);
    PngOptions png{.pixel_mm = a.figure.pixel_mm()};
    std::vector<std::uint8_t> alpha;
    if (a.figure.isClear()) {
      frame.background = {0, 0, 0};
      alpha = makeClear(picture, drawn(frame, figures));
      png.alpha = &alpha;
    }
    writePng(picture, a.out, png);
    return figures;
  }

  Picture drawn(const SceneFrame& frame, SceneFigures& figures) const {
    Picture picture = withoutMarks(frame, figures);
    Canvas canvas(picture);
    mark(canvas, frame);
    return picture;
  }

  Picture withoutMarks(const SceneFrame& frame, SceneFigures& figures) const {
    Progress progress({.title = "render", .noun = "tiles"});
    figures = scene.drawWhole(frame, [&](std::size_t done, std::size_t all) {
      throwIfInterrupted();
      progress.setTotal(all);
      progress.update(done);
    });
    progress.finish();
    return renderer.read();
  }

  static EyeView viewOfFrame(const SceneFrame& frame) {
    return viewOf(frame.orthographic ? parallel(frame.camera) : frame.camera, frame.size.aspect(), frame.eyes.widening);
  }

  void mark(Canvas& canvas, const SceneFrame& frame) const {
    FigureMarks marks{.title = a.figure.title,
                      .scale_bar = a.figure.scale_bar,
                      .orientation = a.figure.orientation,
                      .on_light = a.figure.isLight(a.theme)};
    if (a.with_legend) marks.legend = frame.cell_colours;
    if (a.figure.legend && frame.colour == ColourBy::type && frame.cell_colours == nullptr) {
      auto types = std::make_shared<CellColours>();
      types->attribute = "type";
      types->legend = legendOfTypes();
      marks.legend = types;
    }
    const Camera camera = frame.orthographic ? parallel(frame.camera) : frame.camera;
    drawMarks(canvas, frame.size, viewOfFrame(frame), camera.focus_um, marks);
  }

  // Colours on white become colours with an opacity, by the same picture on black.
  static std::vector<std::uint8_t> makeClear(Picture& on_white, const Picture& on_black) {
    std::vector<std::uint8_t> alpha(on_white.rgb.size() / 3);
    for (std::size_t i = 0; i < alpha.size(); ++i) {
      int through = 255;
      for (std::size_t c = 3 * i; c < 3 * i + 3; ++c) through = std::min(through, on_white.rgb[c] - on_black.rgb[c]);
      alpha[i] = static_cast<std::uint8_t>(255 - std::max(0, through));
      for (std::size_t c = 3 * i; c < 3 * i + 3; ++c)
        on_white.rgb[c] =
            alpha[i] == 0 ? 255
                          : static_cast<std::uint8_t>(std::min(255, (255 * on_black.rgb[c] + alpha[i] / 2) / alpha[i]));
    }
    return alpha;
  }

  SceneFigures writeVectors(VectorFormat format, const SceneFrame& frame) const {
    SceneFigures figures;
    std::string document;
    const bool is_raster = store.segmentCount() > kMostVectorSegments;
    const Picture raster = is_raster ? withoutMarks(frame, figures) : Picture();
    {
      Canvas canvas(frame.size.width, frame.size.height, document, format, a.figure.pixel_mm());
      if (is_raster) {
        canvas.picture(raster);
      } else {
        if (!a.figure.isClear()) canvas.fill(0, 0, frame.size.width, frame.size.height, frame.background);
        figures.segments = store.segmentCount();
        figures.tiles = store.tile_count();
        drawVectors(canvas, frame.size, viewOfFrame(frame), store,
                    {.colour = frame.colour,
                     .cell_colours = frame.cell_colours,
                     .shallow_um = scene.hi_W().y(),
                     .deep_um = scene.lo_W().y()});
      }
      mark(canvas, frame);
    }
    if (is_raster)
      std::cerr << "filiform: note: the neurites are a picture inside the page: "
                << counted(store.segmentCount(), "segment") << " are more than the " << formatCount(kMostVectorSegments)
                << " that are drawn as lines; --only chooses cells\n";
    Output out(a.out, {.cancel = &interruptFlag()});
    out.write(document);
    out.finish();
    return figures;
  }
};

}  // namespace

std::optional<VectorFormat> vectorFormatOf(const std::string& out) {
  if (endsWithNoCase(out, ".svg")) return VectorFormat::svg;
  return endsWithNoCase(out, ".pdf") ? std::optional(VectorFormat::pdf) : std::nullopt;
}

SceneFigures writePicture(SceneFrame& frame, const PictureOutput& output, const TileStore& store, SceneView& scene,
                          Renderer& renderer) {
  return PictureWriter{output, store, scene, renderer}.write(frame);
}

}  // namespace filiform::tools
