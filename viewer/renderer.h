// Draws batches of threads into a framebuffer of its own, for one eye or two, and reads the picture back.
//
//   const auto context = makeOffscreenContext();
//   Renderer renderer(*context);
//   renderer.put(1, makeBatch(tile, appearance));
//   renderer.draw(stereoViews(camera, aspect, 0), {.size = {1280, 800}});
//   const Picture picture = renderer.read();
//
// Threads are lit lines where they are thinner than a pixel, and round cones, drawn about their picture with their
// depth at each pixel, where they are thicker. Depth is told by fog, by halos that cut what lies behind, and by
// clearing what stands before the place that is looked at. Thread rule: the thread of its context.
#pragma once

#include "viewer/graphics_context.h"
#include "viewer/stereo.h"
#include "viewer/thread_batches.h"

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
  marks,  // glyph, proxy, workspace: neither fogged nor cleared, and seen faintly through what hides them
};

struct RenderOptions {
  PictureSize size{};
  StereoMode stereo = StereoMode::mono;
  int samples = 2;  // across a pixel, in each direction, 1 .. 4; halved where the card's pictures are not large enough
  Rgba background{13, 15, 20, 255};
  // Threads fade into the background from the first depth to the second, down to this part.
  double fog_begin_um = 1e9, fog_end_um = 2e9, fog_most = 0;
  // Nothing is drawn before the first depth, everything from the second on.
  double clear_end_um = -2, clear_begin_um = -1;
  double halo_px = 2;  // about threads; 0: none
};

struct RenderFigures {
  std::uint64_t lines = 0, cones = 0;  // segments drawn, of one eye
  std::uint32_t batches = 0, culled = 0;
};

class Renderer {
 public:
  static constexpr int kMaxSize = 8192;

  // The context must be current and outlive it. Throws GraphicsError where a shader is refused.
  explicit Renderer(GraphicsContext& context);
  ~Renderer();

  using BatchId = std::uint64_t;
  // Uploads; replaces what had the id. O(segments). Throws GraphicsError when the card has no room.
  void put(BatchId id, const ThreadBatch& batch, Layer layer = Layer::threads);
  void remove(BatchId id);      // nothing if there is none
  std::uint64_t bytes() const;  // of all that was uploaded

  // Views of the left and the right eye, whose proportions are those of eyeSize(); mono draws the first alone. Throws
  // UsageError for a size outside 1 .. kMaxSize, GraphicsError when the card has no room. O(batches + segments in the
  // picture).
  RenderFigures draw(const std::array<EyeView, 2>& views, const RenderOptions& options);
  // What was drawn last.
  Picture read() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform
