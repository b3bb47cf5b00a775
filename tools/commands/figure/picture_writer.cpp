#include "tools/commands/figure/picture_writer.h"

#include "index/count_text.h"
#include "index/errors.h"
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

constexpr std::uint8_t kSecondGround = 160;  // light as white, so that the proxy has the same colour

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
      frame.background = {kSecondGround, kSecondGround, kSecondGround};
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

  static Camera cameraOf(const SceneFrame& frame) { return frame.orthographic ? parallel(frame.camera) : frame.camera; }
  static EyeView viewOfFrame(const SceneFrame& frame) {
    return viewOf(cameraOf(frame), frame.size.aspect(), frame.eyes.widening);
  }

  void mark(Canvas& canvas, const SceneFrame& frame) const {
    FigureMarks marks{.title = a.figure.title,
                      .scale_bar = a.figure.scale_bar,
                      .orientation = a.figure.orientation,
                      .on_light = a.figure.on(a.theme) == Theme::light};
    if (a.with_legend) marks.legend = frame.cell_colours;
    if (a.figure.legend && frame.colour == ColourBy::type && frame.cell_colours == nullptr) {
      auto types = std::make_shared<CellColours>();
      types->attribute = "type";
      types->legend = legendOfTypes();
      marks.legend = types;
    }
    drawMarks(canvas, frame.size, viewOfFrame(frame), cameraOf(frame).focus_um, marks);
  }

  // Of a picture on white, and the same on a light grey: colours and opacities, which give both.
  static std::vector<std::uint8_t> makeClear(Picture& on_white, const Picture& on_grey) {
    std::vector<std::uint8_t> alpha(on_white.rgb.size() / 3);
    for (std::size_t i = 0; i < alpha.size(); ++i) {
      int seen = 255 - kSecondGround;  // of the grounds' difference
      for (std::size_t c = 3 * i; c < 3 * i + 3; ++c) seen = std::min(seen, on_white.rgb[c] - on_grey.rgb[c]);
      const int opacity = 255 - std::max(0, seen) * 255 / (255 - kSecondGround);
      alpha[i] = static_cast<std::uint8_t>(opacity);
      for (std::size_t c = 3 * i; c < 3 * i + 3; ++c) {
        const int colour = opacity == 0 ? 255 : 255 - 255 * (255 - on_white.rgb[c]) / opacity;
        on_white.rgb[c] = static_cast<std::uint8_t>(std::clamp(colour, 0, 255));
      }
    }
    return alpha;
  }

  SceneFigures writeVectors(VectorFormat format, const SceneFrame& frame) const {
    SceneFigures figures;
    std::string document;
    const bool is_raster = store.segmentCount() > kMostVectorSegments;
    if (is_raster && a.figure.isClear())
      throw UsageError(
          "--background none: " + counted(store.segmentCount(), "segment") +
          " are drawn as a picture in the page, which has a ground; choose cells with --only, or write PNG");
    const Picture raster = is_raster ? withoutMarks(frame, figures) : Picture();
    {
      Canvas canvas(frame.size.width, frame.size.height, document, format, a.figure.pixel_mm());
      if (is_raster) {
        canvas.picture(raster);
      } else {
        if (!a.figure.isClear()) canvas.fill(0, 0, frame.size.width, frame.size.height, frame.background);
        Progress progress({.title = "render", .noun = "tiles"});
        progress.setTotal(store.tile_count());
        figures.tiles = store.tile_count();
        const VectorScene vectors{.colour = frame.colour,
                                  .cell_colours = frame.cell_colours,
                                  .shallow_um = scene.hi_W().y(),
                                  .deep_um = scene.lo_W().y(),
                                  .check = [&](TileId done) {
                                    throwIfInterrupted();
                                    progress.update(done);
                                  }};
        const VectorFigures drawn = drawVectors(canvas, frame.size, viewOfFrame(frame), store, vectors);
        figures.segments = drawn.segments;
        figures.implausible_radii = drawn.implausible_radii;
        progress.finish();
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
