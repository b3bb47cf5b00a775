#include "viewer/gl/internal/pieces.h"

#include <algorithm>
#include <cmath>
#include <compare>
#include <optional>
#include <utility>

namespace filiform::internal {

namespace {

// Radii in sample pixels. Below the first a segment is a line, one pixel wide. Below the second it is a ribbon, a line
// two samples wide. A cone costs five times as much.
constexpr double kLineRadius_px = 0.6, kRibbonRadius_px = 1.25;
// What a part draws between two looks at the clock: some 10 ms with a software renderer.
constexpr double kQuickSamples = 1 << 20;
// A ball below this radius, in pixels of the picture, lies at one depth: see ball.vert.
constexpr double kFlatBall_px = 6;

// True if a ball is before the whole picture, because the eye is in it. `p_V`: its centre, which is in front of the
// eye.
bool isAround(const EyeView& view, const RenderOptions& options, const Vector3d& p_V, double radius_um) {
  const Frustum& f = view.frustum;
  const double away_um = -p_V.z(),
               fade = (away_um - options.clear_end_um) / (options.clear_begin_um - options.clear_end_um);
  const double part = std::clamp(fade, 0.0, 1.0), x = p_V.x() / away_um, y = p_V.y() / away_um;
  const double reach_um = radius_um * part * part * (3 - 2 * part);  // as the shaders have it
  const double aside = std::max(std::abs(x - f.left / f.near_um), std::abs(x - f.right / f.near_um));
  const double above = std::max(std::abs(y - f.bottom / f.near_um), std::abs(y - f.top / f.near_um));
  return reach_um >= away_um * std::hypot(1, aside, above);
}

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

std::size_t Piece::quickGroup(std::size_t begin, const PictureSize& size) const {
  if (primitiveOf(stage) == Primitive::line) return count - begin;
  const double all = static_cast<double>(size.width) * size.height, across = std::hypot(size.width, size.height);
  double covered = 0;
  std::size_t i = begin;
  for (; i < count && (i == begin || covered < kQuickSamples); ++i) {
    const double thick = 2 * batch->radius_um(first + i), along = thick + batch->length_um(first + i);
    covered += std::min(all, std::min(thick / um_px, across) * std::min(along / um_px, across));
  }
  return i - begin;
}

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
  // Of the balls around the eye only the one with the nearest centre shows.
  struct Ball {
    const CardBatch* batch;
    std::size_t index;
    auto operator<=>(const Ball&) const = default;
  };
  std::vector<Ball> hidden;
  std::optional<Ball> around;
  double around_um = INFINITY;
  const auto lookAround = [&](const CardBatch& batch, const CardBatch::Block& block, std::size_t end) {
    const Vector3d origin_V = view.toView(batch.origin_W());
    for (std::size_t i = block.begin; i < end; ++i) {
      const Vector3d p_V = origin_V + view.rotation_VW * batch.ball_um(block, i).cast<double>();
      if (-p_V.z() < std::max(f.near_um, options.clear_end_um) || !isAround(view, options, p_V, batch.radius_um(i)))
        continue;
      Ball ball{&batch, i};
      if (-p_V.z() < around_um) {
        around_um = -p_V.z();
        if (around) std::swap(ball, *around);
        around = around.value_or(ball);
      }
      if (ball != *around) hidden.push_back(ball);
    }
  };
  std::vector<CardBatch*> overlays;
  const auto addBlock = [&](CardBatch& batch, const CardBatch::Block& block) {
    const double um_px = pixelAt(block, clear);
    neurites.push_back({&batch, &block, um_px, batch.ballsAtLeastAsThickAs(block, kFlatBall_px * samples * um_px),
                        batch.atLeastAsThickAs(block, kRibbonRadius_px * um_px),
                        batch.atLeastAsThickAs(block, kLineRadius_px * um_px),
                        block.distance_um(view.eye_W) < fades_until_um});
    lookAround(batch, block, neurites.back().large_balls);
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
  const auto add = [&](Stage stage, From from, CardBatch* batch, std::size_t begin, std::size_t end, double um_px) {
    if (begin >= end) return;
    // Blocks that follow one another are drawn by one call.
    if (!pieces.empty()) {
      Piece& last = pieces.back();
      if (last.stage == stage && last.from == from && last.batch == batch && last.first + last.count == begin) {
        last.count = end - last.first;
        last.um_px = std::min(last.um_px, um_px);
        return;
      }
    }
    pieces.push_back({stage, from, batch, begin, end - begin, um_px});
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
    for (const Part& p : highlights) add(lines, From::lines, p.batch, p.cones, endOf(p), p.um_px);
    for (const Part& p : highlights)
      add(cones, From::cones, p.batch, p.block->begin, std::min(p.cones, endOf(p)), p.um_px);
  };
  const auto addOverlays = [&](Stage stage) {
    for (CardBatch* const batch : overlays) add(stage, From::cones, batch, 0, batch->size(), INFINITY);
  };
  for (const Part& p : neurites) add(Stage::ribbons, From::ribbons, p.batch, p.cones, p.ribbons, p.um_px);
  for (const Part& p : neurites) add(Stage::lines, From::lines, p.batch, p.ribbons, p.block->end, p.um_px);
  std::sort(hidden.begin(), hidden.end());
  const auto addLargeBalls = [&](Stage stage, const Part& p) {
    std::size_t begin = p.block->begin;
    for (auto ball = std::lower_bound(hidden.begin(), hidden.end(), Ball{p.batch, begin});
         ball != hidden.end() && ball->batch == p.batch && ball->index < p.large_balls; ++ball) {
      add(stage, From::large_balls, p.batch, begin, ball->index, p.um_px);
      begin = ball->index + 1;
    }
    add(stage, From::large_balls, p.batch, begin, p.large_balls, p.um_px);
  };
  for (const Part& p : neurites) addLargeBalls(Stage::large_balls, p);
  for (const Part& p : neurites) add(Stage::cones, From::cones, p.batch, p.block->balls_end, p.cones, p.um_px);
  // Last, because what is hidden then costs least.
  for (const Part& p : neurites) add(Stage::balls, From::balls, p.batch, p.large_balls, p.block->balls_end, p.um_px);
  if (options.halo_px > 0) {
    for (const Part& p : neurites) addLargeBalls(Stage::large_ball_halos, p);
    for (const Part& p : neurites) add(Stage::halos, From::cones, p.batch, p.block->balls_end, p.cones, p.um_px);
    for (const Part& p : neurites)
      add(Stage::ball_halos, From::balls, p.batch, p.large_balls, p.block->balls_end, p.um_px);
  }
  std::erase_if(neurites, [](const Part& p) { return !p.fades; });
  for (const Part& p : neurites) add(Stage::fading_ribbons, From::ribbons, p.batch, p.cones, p.ribbons, p.um_px);
  for (const Part& p : neurites) add(Stage::fading_lines, From::lines, p.batch, p.ribbons, p.block->end, p.um_px);
  // Dense tissue would hide these: draw them faintly without a depth test first, then normally.
  addHighlights(Stage::highlight_faint_lines, Stage::highlight_faint);
  addHighlights(Stage::highlight_lines, Stage::highlight);
  addOverlays(Stage::overlays_faint);
  addOverlays(Stage::overlay_halos);
  addOverlays(Stage::overlays);
  return figures;
}

}  // namespace filiform::internal
