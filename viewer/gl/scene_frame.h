// What a frame of a scene shows, how much it may cost, and what was drawn. Thread rule: plain data.
#pragma once

#include "viewer/gl/render_options.h"
#include "viewer/scene/camera.h"
#include "viewer/scene/cell_palette.h"
#include "viewer/scene/draw_list.h"
#include "viewer/scene/glyph.h"
#include "viewer/scene/overlay.h"
#include "viewer/scene/stereo.h"

#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace filiform {

struct SceneBudget {
  std::uint64_t segments = 2'000'000;         // chosen at rest, at most
  std::uint64_t moving_segments = 2'000'000;  // chosen while camera or proxy move, at most
  int samples = 2, moving_samples = 2;        // across a pixel
  bool moving_shade = true;                   // use eye-dome lighting of far views also in motion
  int moving_stretch = 1;  // a pixel in motion covers so many of the screen in each direction, up to kMostStretch
  double enough_px = Levels::kEnough_px;  // choose no finer tiles where the error is below this
  std::uint64_t upload_bytes = 4U << 20;  // in one frame; one tile is always uploaded
  double upload_ms = 2;                   // in one frame; one tile is always uploaded
  // At rest a picture is drawn in parts of this length, one a frame. In motion a frame draws the whole picture: what
  // takes longer than a part is begun again with larger pixels.
  double part_ms = INFINITY, moving_part_ms = INFINITY;
  std::uint64_t card_bytes = 1ULL << 30;  // above this, tiles that are not drawn are removed from the card

  static constexpr int kMostStretch = 8;
};

// What one frame shows. Its pointers must stay valid during the call only.
struct SceneFrame {
  Camera camera{};
  // Drawn as two boxes. Fog begins behind its middle, and neurites between the camera and the workspace fade.
  // nullptr: fog and eye-dome lighting over the depth of the whole scene.
  const Workspace* workspace = nullptr;
  std::optional<Vector3d> proxy_W{};      // drawn as a ball
  std::optional<Vector3d> companion_W{};  // the proxy of somebody else: drawn as a ball of another colour
  std::shared_ptr<const std::vector<Vector3d>> marks_W{};  // drawn as small balls
  std::optional<Stylus> stylus{};
  const Junction* junction = nullptr;  // drawn as a glyph
  GlyphPalette palette = kRedGreen;    // of the glyph; an anaglyph uses kForGlasses
  ColourBy colour = ColourBy::cell;
  std::shared_ptr<const CellColours> cell_colours{};  // if set: replace `colour`
  std::shared_ptr<const CellStates> states{};         // nullptr: all cells are shown
  std::uint8_t hidden_types = 0;                      // as CellPalette has them
  // Highlighted: drawn in full resolution over the others, which are dimmed. Ascending.
  std::vector<std::uint32_t> cells{};
  bool orthographic = false;  // see parallel()
  bool flat = false;          // without fog and eye-dome lighting
  Rgba background = kDarkGround;
  // From any clock that never runs backwards. Used to detect rest, to smooth the eye separation, and to retry tiles.
  double time_s = 0;
  std::optional<bool> moving{};  // none: in motion until kRest_s after the camera or the proxy last moved

  PictureSize size{};
  StereoMode stereo = StereoMode::mono;
  StereoOptions eyes{};
  SceneBudget budget{};
  bool frozen = false;       // keep the chosen tiles, however the camera moves
  double overlay_scale = 0;  // size of boxes, proxy and glyph; 0: by the picture's height

  static constexpr double kRest_s = 0.3;
};

struct SceneFigures {
  RenderFigures drawn;
  bool redrawn = false;              // false: the last picture was kept
  bool refined = false;              // redrawn: the view is that of the picture before
  bool drawing = false;              // a picture is drawn in parts: more frames are needed
  double picture_ms = 0;             // of the last new picture, all its parts together
  int samples = 0, stretch = 1;      // of the last new picture: across a pixel; screen pixels across a pixel
  bool moving = false;               // drawn with the budget for motion
  bool complete = false;             // every chosen tile is in the picture, without stand-ins
  std::uint64_t segments = 0;        // of the drawn tiles
  std::uint64_t hidden = 0;          // full-resolution segments that levels hide: others cover their pixels
  std::uint64_t left_out = 0;        // full-resolution segments in view, in places of which no tile is drawn
  bool limited = false;              // levels are coarser than `enough_px`, because of the budget
  std::uint64_t tiles_left_out = 0;  // without levels: tiles beyond the budget
  double error_px = 0;               // largest error of the drawn tiles; may be infinite
  double wanted_error_px = 0;        // largest error of the chosen tiles
  std::uint32_t tiles = 0;           // drawn
  std::uint32_t stand_ins = 0;       // drawn tiles that are coarser or finer than chosen
  bool has_gaps = false;             // some place has no uploaded tile yet
  std::uint32_t pending = 0;         // chosen tiles that are not uploaded yet
  std::uint32_t uploads = 0;         // tiles, in this frame
  std::uint64_t upload_bytes = 0;
  double upload_ms = 0;
  std::uint64_t card_bytes = 0;         // of all batches
  std::uint64_t implausible_radii = 0;  // in the drawn tiles
  double separation = 0;                // of the eyes, divided by their distance of convergence
  std::vector<std::string> failed;      // one line for each tile that cannot be read, with the reason
};

}  // namespace filiform
