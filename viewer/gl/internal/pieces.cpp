#include "viewer/gl/internal/pieces.h"

#include <algorithm>
#include <cmath>

namespace filiform::internal {

namespace {

// Radii in sample pixels. Below the first a segment is a line, one pixel wide. Below the second it is a ribbon, a line
// two samples wide. A cone costs five times as much.
constexpr double kLineRadius_px = 0.6, kRibbonRadius_px = 1.25;
// A ball below this radius, in pixels of the picture, lies at one depth: see ball.vert.
constexpr double kFlatBall_px = 6;

}  // namespace

Primitive primitiveOf(Stage stage) {
  switch (stage) {
    case Stage::ribbons:
    case Stage::lines:
    case Stage::fading_ribbons:
    case Stage::fading_lines:
    case Stage::highlight_faint_lines:
    case Stage::highlight_lines:
      return Primitive::line;
    case Stage::balls:
    case Stage::ball_halos:
      return Primitive::ball;
    default:
      return Primitive::cone;
  }
}
bool isHalo(Stage stage) {
  return (stage >= Stage::large_ball_halos && stage <= Stage::ball_halos) || stage == Stage::overlay_halos;
}
bool fades(Stage stage) { return stage == Stage::fading_ribbons || stage == Stage::fading_lines; }

RenderFigures listPieces(const EyeView& view, const PictureSize& size, int samples, const RenderOptions& options,
                         std::map<BatchId, CardBatch>& batches, std::vector<Piece>& pieces) {
  const LevelView whole = levelView(view, size), clear = levelView(view, size, options.clear_end_um);
  const auto pixelAt = [&](const CardBatch::Block& block, const LevelView& from) {
    return std::max(block.distance_um(view.eye_W), from.nearest_um) / from.pixels_per_rad;
  };
  RenderFigures figures;
  // A block of neurites: large balls up to `large_balls`, small ones up to the block's `balls_end`, cones up to
  // `cones`, ribbons up to `ribbons`, then lines. Of a highlight: cones up to `cones`, then lines.
  struct Part {
    CardBatch* batch;
    const CardBatch::Block* block;
    double um_px;
    std::size_t large_balls, cones, ribbons;
    bool fades = false;
  };
  // A distance is at least a depth. At the rim of the picture it is longer.
  const Frustum& f = view.frustum;
  const double rim = std::hypot(1, std::max(-f.left, f.right) / f.near_um, std::max(-f.bottom, f.top) / f.near_um);
  const double fades_until_um = options.clear_begin_um > f.near_um ? rim * options.clear_begin_um : 0;
  std::vector<Part> neurites, highlights;
  std::vector<CardBatch*> overlays;
  const auto addBlock = [&](CardBatch& batch, const CardBatch::Block& block) {
    const double um_px = pixelAt(block, clear);
    neurites.push_back({&batch, &block, um_px, batch.ballsAtLeastAsThickAs(block, kFlatBall_px * samples * um_px),
                        batch.atLeastAsThickAs(block, kRibbonRadius_px * um_px),
                        batch.atLeastAsThickAs(block, kLineRadius_px * um_px),
                        block.distance_um(view.eye_W) < fades_until_um});
    figures.cones += neurites.back().cones - block.begin;
    figures.lines += block.end - neurites.back().cones;
  };
  std::uint64_t highlighted = 0;
  const auto addHighlight = [&](CardBatch& batch, const CardBatch::Block& block) {
    const double um_px = pixelAt(block, whole);
    const std::size_t cones = batch.atLeastAsThickAs(block, kHighlightRadius_px * samples * um_px);
    highlights.push_back({&batch, &block, um_px, 0, cones, cones});
    highlighted += block.end - block.begin;
  };
  for (auto& [id, batch] : batches) {
    if (!batch.shown) continue;
    bool seen = false;
    for (const CardBatch::Block& block : batch.blocks()) {
      if (!block.isSeen(batch.layer() == Layer::neurites ? clear : whole)) continue;
      seen = true;
      if (batch.layer() == Layer::neurites) addBlock(batch, block);
      if (batch.layer() == Layer::highlight) addHighlight(batch, block);
    }
    ++(seen ? figures.batches : figures.culled);
    if (seen && batch.layer() == Layer::overlays) overlays.push_back(&batch);
  }

  std::stable_sort(neurites.begin(), neurites.end(), [](const Part& a, const Part& b) { return a.um_px < b.um_px; });
  pieces.clear();
  using From = CardBatch::From;
  const auto add = [&](Stage stage, From from, CardBatch* batch, std::size_t begin, std::size_t end) {
    if (begin >= end) return;
    // Blocks that follow one another are drawn by one call.
    if (!pieces.empty()) {
      Piece& last = pieces.back();
      if (last.stage == stage && last.from == from && last.batch == batch && last.first + last.count == begin) {
        last.count = end - last.first;
        return;
      }
    }
    pieces.push_back({stage, from, batch, begin, end - begin});
  };
  const double kept =
      static_cast<double>(options.most_highlighted) / static_cast<double>(std::max<std::uint64_t>(highlighted, 1));
  const auto endOf = [kept](const Part& p) {
    const auto all = static_cast<double>(p.block->end - p.block->begin);
    return p.block->begin + static_cast<std::size_t>(std::ceil(all * std::min(kept, 1.0)));
  };
  for (const Part& p : highlights) {
    figures.cones += std::min(p.cones, endOf(p)) - p.block->begin;
    figures.lines += endOf(p) - std::min(p.cones, endOf(p));
  }
  const auto addHighlights = [&](Stage lines, Stage cones) {
    for (const Part& p : highlights) add(lines, From::lines, p.batch, p.cones, endOf(p));
    for (const Part& p : highlights) add(cones, From::cones, p.batch, p.block->begin, std::min(p.cones, endOf(p)));
  };
  const auto addOverlays = [&](Stage stage) {
    for (CardBatch* const batch : overlays) add(stage, From::cones, batch, 0, batch->size());
  };
  for (const Part& p : neurites) add(Stage::ribbons, From::ribbons, p.batch, p.cones, p.ribbons);
  for (const Part& p : neurites) add(Stage::lines, From::lines, p.batch, p.ribbons, p.block->end);
  for (const Part& p : neurites) add(Stage::large_balls, From::large_balls, p.batch, p.block->begin, p.large_balls);
  for (const Part& p : neurites) add(Stage::cones, From::cones, p.batch, p.block->balls_end, p.cones);
  // Last, because what is hidden then costs least.
  for (const Part& p : neurites) add(Stage::balls, From::balls, p.batch, p.large_balls, p.block->balls_end);
  if (options.halo_px > 0) {
    for (const Part& p : neurites)
      add(Stage::large_ball_halos, From::large_balls, p.batch, p.block->begin, p.large_balls);
    for (const Part& p : neurites) add(Stage::halos, From::cones, p.batch, p.block->balls_end, p.cones);
    for (const Part& p : neurites) add(Stage::ball_halos, From::balls, p.batch, p.large_balls, p.block->balls_end);
  }
  std::erase_if(neurites, [](const Part& p) { return !p.fades; });
  for (const Part& p : neurites) add(Stage::fading_ribbons, From::ribbons, p.batch, p.cones, p.ribbons);
  for (const Part& p : neurites) add(Stage::fading_lines, From::lines, p.batch, p.ribbons, p.block->end);
  // Dense tissue would hide these: draw them faintly without a depth test first, then normally.
  addHighlights(Stage::highlight_faint_lines, Stage::highlight_faint);
  addHighlights(Stage::highlight_lines, Stage::highlight);
  addOverlays(Stage::overlays_faint);
  addOverlays(Stage::overlay_halos);
  addOverlays(Stage::overlays);
  return figures;
}

}  // namespace filiform::internal
