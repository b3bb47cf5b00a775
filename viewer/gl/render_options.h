// How a picture is drawn, and what was drawn. Thread rule: plain data.
#pragma once

#include "viewer/scene/neurite_batches.h"
#include "viewer/scene/stereo.h"

#include <cstdint>

namespace filiform {

// What a batch is drawn as.
enum class Layer : std::uint8_t {
  neurites,
  highlight,  // neurites of a highlighted cell: at least 2 pixels thick, without fog, dimming and fading, and faintly
              // visible through nearer ones
  overlays,   // glyph, proxy, workspace: without fog and fading, and faintly visible through nearer neurites
};

// How a picture looks.
struct RenderOptions {
  PictureSize size{};
  StereoMode stereo = StereoMode::mono;
  int samples = 2;  // across a pixel, in each direction, 1 .. 4; halved where the card's textures are too small
  Rgba background = kDarkGround;
  // Fog: neurites mix with the background from 0 at the first depth to `fog_most` (0 .. 1) at the second.
  double fog_begin_um = 1e9, fog_end_um = 2e9, fog_most = 0;
  double dim = 0;  // mixes neurites with the background at any depth, 0 .. 1
  // Fading: neurites get thinner from depth `clear_begin_um` towards the eye, to nothing at `clear_end_um`.
  double clear_end_um = -2, clear_begin_um = -1;
  double halo_px = 2;  // width of halos; 0: none
  // Segments of highlighted cells, at most: the thickest of each place.
  std::uint64_t most_highlighted = UINT64_MAX;
  // Eye-dome lighting: a point this far or farther behind its neighbour on the screen is darkest; 0: none.
  double shade_um = 0;
};

// What was drawn in one picture.
struct RenderFigures {
  std::uint64_t lines = 0, cones = 0;  // segments drawn for one eye; ribbons count as lines
  std::uint32_t batches = 0, culled = 0;
};

using BatchId = std::uint64_t;  // of a batch in a Renderer

}  // namespace filiform
