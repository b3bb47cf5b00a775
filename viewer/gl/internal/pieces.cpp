#include "viewer/gl/internal/pieces.h"

#include <algorithm>

namespace filiform::internal {

namespace {

// Radii in sample pixels. Below the first a segment is a line, one pixel wide. Below the second it is a ribbon, a line
// two samples wide. A cone costs five times as much.
constexpr double kLineRadius_px = 0.6, kRibbonRadius_px = 1.25;
// A ball below this radius, in pixels of the picture, lies at one depth: see ball.vert.
constexpr double kFlatBall_px = 6;

}  // namespace

RenderFigures listPieces(const EyeView& view, const PictureSize& size, int samples, std::size_t most_segments,
                         std::map<BatchId, CardBatch>& batches, std::vector<Piece>& pieces) {
  const LevelView levels = levelView(view, size);
  RenderFigures figures;
  // A neurite's batch: large balls up to `large_balls`, small ones up to `balls`, cones up to `cones`, ribbons up to
  // `ribbons`, then lines.
  struct Part {
    CardBatch* batch;
    std::size_t large_balls, balls, cones, ribbons;
  };
  std::vector<Part> neurites;
  std::vector<CardBatch*> highlights, overlays;
  for (auto& [id, batch] : batches) {
    if (!batch.shown) continue;
    if (!batch.isSeen(levels)) {
      ++figures.culled;
      continue;
    }
    ++figures.batches;
    if (batch.layer() != Layer::neurites) {
      (batch.layer() == Layer::overlays ? overlays : highlights).push_back(&batch);
      if (batch.layer() == Layer::highlight) figures.cones += batch.size();
      continue;
    }
    const double um_px = batch.distance_um(view.eye_W) / levels.pixels_per_rad;
    neurites.push_back({&batch, batch.ballsAtLeastAsThickAs(kFlatBall_px * samples * um_px), batch.balls(),
                        batch.atLeastAsThickAs(kRibbonRadius_px * um_px),
                        batch.atLeastAsThickAs(kLineRadius_px * um_px)});
    figures.cones += neurites.back().cones;
    figures.lines += batch.size() - neurites.back().cones;
  }

  pieces.clear();
  using From = CardBatch::From;
  const auto add = [&](Stage stage, From from, CardBatch* batch, std::size_t begin, std::size_t end) {
    for (std::size_t first = begin; first < end; first += most_segments)
      pieces.push_back({stage, from, batch, first, std::min(most_segments, end - first)});
  };
  const auto addAll = [&](Stage stage, const std::vector<CardBatch*>& list) {
    for (CardBatch* const batch : list) add(stage, From::cones, batch, 0, batch->size());
  };
  for (const Part& p : neurites) add(Stage::ribbons, From::ribbons, p.batch, p.cones, p.ribbons);
  for (const Part& p : neurites) add(Stage::lines, From::lines, p.batch, p.ribbons, p.batch->size());
  for (const Part& p : neurites) add(Stage::large_balls, From::large_balls, p.batch, 0, p.large_balls);
  for (const Part& p : neurites) add(Stage::cones, From::cones, p.batch, p.balls, p.cones);
  // Last, because what is hidden then costs least.
  for (const Part& p : neurites) add(Stage::balls, From::balls, p.batch, p.large_balls, p.balls);
  // Dense tissue would hide these: draw them faintly without a depth test first, then normally.
  addAll(Stage::highlight_faint, highlights);
  addAll(Stage::highlight, highlights);
  addAll(Stage::overlays_faint, overlays);
  addAll(Stage::overlays, overlays);
  return figures;
}

}  // namespace filiform::internal
