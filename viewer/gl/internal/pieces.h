// The pieces of a picture: which segments of which batch are drawn as what, in drawing order. Thread rule: the thread
// of the context.
#pragma once

#include "viewer/gl/internal/card_batch.h"
#include "viewer/gl/render_options.h"

#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

namespace filiform::internal {

// In drawing order: later stages cover earlier ones.
enum class Stage : std::uint8_t {
  ribbons,
  lines,
  large_balls,
  cones,
  balls,
  large_ball_halos,
  halos,
  ball_halos,
  fading_ribbons,  // lines that fade are mixed with what lies behind
  fading_lines,
  highlight_faint_lines,
  highlight_faint,
  highlight_lines,
  highlight,
  overlays_faint,
  overlay_halos,
  overlays
};

enum class Primitive : std::uint8_t { line, cone, ball };
Primitive primitiveOf(Stage stage);
bool isHalo(Stage stage);
bool fades(Stage stage);

// Least radius of a highlighted cell's segments, in pixels of the picture; thinner ones are lines of this width.
inline constexpr double kHighlightRadius_px = 1.1;

// Segments of one batch that one OpenGL call draws.
struct Piece {
  Stage stage;
  CardBatch::From from;
  CardBatch* batch;
  std::size_t first, count;
  double um_px;  // size of a sample where the segments are nearest; of lines: they cost little

  // The number of segments from first + `begin` on, at least one, that cover few samples of a picture of this size.
  std::size_t quickGroup(std::size_t begin, const PictureSize& size) const;
};

// Replaces `pieces` by those of one eye's view. Within a stage, neurites near the eye come first: those cost most.
// Neurites nearer than `clear_end_um` are left out. Of highlighted cells at most `most_highlighted` segments, about.
// `size`: in samples, of which a pixel has `samples` in each direction. O(blocks log segments).
RenderFigures listPieces(const EyeView& view, const PictureSize& size, int samples, const RenderOptions& options,
                         std::map<BatchId, CardBatch>& batches, std::vector<Piece>& pieces);

}  // namespace filiform::internal
