// Draws batches of segments into its own framebuffer, for one eye or two, and reads the picture back.
//
//   const auto context = makeOffscreenContext();
//   Renderer renderer(*context);
//   renderer.put(1, makeBatch(tile, appearance));
//   renderer.draw(stereoViews(camera, aspect, 0), {.size = {1280, 800}});
//   const Picture picture = renderer.read();
//
// A segment thinner than a pixel is a lit line. A thicker one is a round cone with its own depth at each pixel. A ball
// of few pixels has one depth. Four cues show depth: fog; halos, which cut neurites that lie behind; eye-dome lighting,
// which darkens points beside nearer ones; and neurites between the camera and the focus fade. Thread rule: the thread
// of its context.
#pragma once

#include "viewer/gl/graphics_context.h"
#include "viewer/gl/picture.h"
#include "viewer/gl/render_options.h"
#include "viewer/scene/cell_palette.h"
#include "viewer/scene/neurite_batches.h"
#include "viewer/scene/stereo.h"

#include <array>
#include <cstdint>
#include <memory>

namespace filiform {

class Renderer {
 public:
  static constexpr int kMaxSize = 8192;

  // The context must be current and outlive the renderer. Throws GraphicsError if the driver refuses a shader.
  explicit Renderer(GraphicsContext& context);
  ~Renderer();

  using BatchId = filiform::BatchId;
  // Uploads a batch, and replaces the batch with this id. A batch is shown until show() hides it. O(segments); sorts a
  // batch that is not thickest first. If the card has no memory left, the next picture throws.
  void put(BatchId id, const NeuriteBatch& batch, Layer layer = Layer::neurites);
  void remove(BatchId id);  // no effect if the id is unknown
  // Shows or hides a batch in later pictures. No effect if the id is unknown.
  void show(BatchId id, bool shown);
  void place(BatchId id, Layer layer);  // likewise moves it to a layer
  std::uint64_t bytes() const;          // uploaded, of all batches
  // Draws the neurites of all batches in these colours from the next picture on. Uploads no segment. Until the first
  // call, cells have their own colours. O(cells).
  void paint(const CellPalette& palette);

  // Draws a small picture of each kind: drivers compile a shader when it is first used, which takes up to 0.1 s each.
  // Call it before the first batch. The last picture is then black.
  void warmUp();

  // True: the context belongs to a window with a picture for each eye (StereoMode::quad_buffer).
  bool hasQuadBuffer() const;

  // Draws the views of the left and the right eye; mono draws the first only. Their proportions must be those of
  // eyeSize(). Throws UsageError for a size outside 1 .. kMaxSize; GraphicsError if the card has no memory left or no
  // quad-buffer stereo, or if OpenGL reports an error; the picture is then drawn as far as it could be. O(batches +
  // segments in view).
  RenderFigures draw(const std::array<EyeView, 2>& views, const RenderOptions& options);
  // Does draw() in parts, for a picture that takes longer than a frame. begin() prepares, and throws as draw(). Each
  // advance() draws for about `most_ms`, at least one segment, and returns the part that is done, 0 to 1. At 1 the
  // picture equals that of draw(); until then read() and present() have the picture before. A batch that changes before
  // abandons the picture: isUnderWay() is then false, and advance() returns 1.
  RenderFigures begin(const std::array<EyeView, 2>& views, const RenderOptions& options);
  double advance(double most_ms);
  bool isUnderWay() const;
  // The last picture; of quad-buffer stereo the left eye's.
  Picture read() const;
  // Does read() in parts: appends at most `most_rows` to the picture, which must be empty at first. True: it is whole.
  // The card copies the rows of the next call meanwhile, so the first call appends none.
  bool readMore(Picture& picture, int most_rows) const;
  // The pixels of the current context's own framebuffer, before the window shows them.
  static Picture readWindow(const PictureSize& window);
  // Waits until the last pixel is drawn. For measurements.
  void finish() const;
  // Copies the last picture into the context's own framebuffer, and stretches it if the window has another size. That
  // framebuffer is bound afterwards. No effect before the first picture. Throws UsageError for a size below 1 x 1.
  // `shown` below 1: mixes the last picture with the one before, if both have the window's size, no other picture is
  // under way, and it is not quad-buffer stereo.
  void present(const PictureSize& window, double shown = 1);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform
