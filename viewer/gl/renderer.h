// Draws batches of threads into a framebuffer of its own, for one eye or two, and reads the picture back.
//
//   const auto context = makeOffscreenContext();
//   Renderer renderer(*context);
//   renderer.put(1, makeBatch(tile, appearance));
//   renderer.draw(stereoViews(camera, aspect, 0), {.size = {1280, 800}});
//   const Picture picture = renderer.read();
//
// Threads are lit lines where they are thinner than a pixel, and round cones, drawn about their picture with their
// depth at each pixel, where they are thicker. Depth is told by fog, by halos that cut what lies behind, by shading
// what has something nearer beside it, and by thinning out what stands before the place that is looked at. Thread rule:
// the thread of its context.
#pragma once

#include "viewer/gl/graphics_context.h"
#include "viewer/scene/neurite_batches.h"
#include "viewer/scene/stereo.h"

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

namespace filiform {

struct Picture {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;  // rows from the top
};

enum class Layer : std::uint8_t {
  threads,
  highlight,  // threads over the others, which recede: never thinner than some pixels, neither fogged nor dimmed, and
              // seen through what hides them
  marks,      // glyph, proxy, workspace: neither fogged nor cleared, and seen faintly through what hides them
};

struct RenderOptions {
  PictureSize size{};
  StereoMode stereo = StereoMode::mono;
  int samples = 2;  // across a pixel, in each direction, 1 .. 4; halved where the card's pictures are not large enough
  Rgba background{13, 15, 20, 255};
  // Threads fade into the background from the first depth to the second, down to this part.
  double fog_begin_um = 1e9, fog_end_um = 2e9, fog_most = 0;
  double dim = 0;  // of threads into the background, at any depth
  // Threads thin out from the second depth towards the eye, to nothing at the first.
  double clear_end_um = -2, clear_begin_um = -1;
  double halo_px = 2;  // about threads; 0: none
  // Eye-dome lighting: what lies this far and more behind its neighbour on the screen is darkened; 0: none.
  double shade_um = 0;
};

struct RenderFigures {
  std::uint64_t lines = 0, cones = 0;  // segments drawn, of one eye; ribbons are lines
  std::uint32_t batches = 0, culled = 0;
};

class Renderer {
 public:
  static constexpr int kMaxSize = 8192;

  // The context must be current and outlive it. Throws GraphicsError where a shader is refused.
  explicit Renderer(GraphicsContext& context);
  ~Renderer();

  using BatchId = std::uint64_t;
  // Uploads; replaces what had the id. O(segments), and a sort where their radii do not fall. Throws GraphicsError when
  // the card has no room.
  void put(BatchId id, const NeuriteBatch& batch, Layer layer = Layer::threads);
  void remove(BatchId id);  // nothing if there is none
  // Leaves it out of pictures, or takes it in again; a new one is drawn. Nothing if there is none.
  void show(BatchId id, bool shown);
  std::uint64_t bytes() const;  // of all that was uploaded

  // Is there a window behind the context that shows each eye its own picture (StereoMode::quad_buffer)?
  bool hasQuadBuffer() const;

  // Views of the left and the right eye, whose proportions are those of eyeSize(); mono draws the first alone. Throws
  // UsageError for a size outside 1 .. kMaxSize, GraphicsError when the card has no room or shows no quad-buffer
  // stereo. O(batches + segments in the picture).
  RenderFigures draw(const std::array<EyeView, 2>& views, const RenderOptions& options);
  // The same in parts, for a picture that takes longer than a frame. begin() does what needs no drawing, and throws as
  // draw() does. Each advance() draws for about `most_ms`, one piece at least, and returns which part of the picture is
  // done: 1 at the end, when the picture is that of draw(). Requires that no batch changes in between.
  RenderFigures begin(const std::array<EyeView, 2>& views, const RenderOptions& options);
  double advance(double most_ms);
  // What was drawn last; of quad-buffer stereo the left eye's.
  Picture read() const;
  // The same in parts: appends at most so many rows to the picture, which is empty at first. True: that was all.
  bool readMore(Picture& picture, int most_rows) const;
  // The pixels of the current context's own framebuffer, before they are shown.
  static Picture readWindow(const PictureSize& window);
  // Returns when the last pixel is drawn: for measurements.
  void finish() const;
  // Copies what was drawn last into the context's own framebuffer, stretched where the window has another size; that
  // framebuffer is bound afterwards. Nothing where nothing was drawn. Throws UsageError for a size below 1 x 1.
  void present(const PictureSize& window) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform
