// Tests pictures by their statistics, not byte by byte, because another driver may round differently. A ball has the
// size and place of the formula, and nearer things hide farther ones.
#include "index/errors.h"
#include "tests/viewer/gl/renderer_fixture.h"
#include "viewer/scene/overlay.h"

#include <cmath>
#include <cstdlib>
#include <numbers>
#include <string>

#include <gtest/gtest.h>

namespace filiform::test {
namespace {

TEST_F(Renderers, EmptyScenesAreBackground) {
  const Picture picture = draw(camera_);
  ASSERT_EQ(picture.rgb.size(), 320u * 200u * 3u);
  const Rgba want = RenderOptions{}.background;
  for (std::size_t i = 0; i < picture.rgb.size(); i += 3)
    ASSERT_EQ((Rgba{picture.rgb[i], picture.rgb[i + 1], picture.rgb[i + 2]}), want);
}

TEST_F(Renderers, BallsAreAsLargeAndWhereTheFormulaSays) {
  for (const Vector3d& far_W : {Vector3d(0, 0, 0), Vector3d(9e8, -8e8, 7e8)}) {
    renderer_.put(1, ball(12, 9, 0, 8, kRed, far_W));
    const Camera camera = lookAt(far_W + Vector3d(0, 0, 100), far_W);
    const LitArea seen = litAreaOf(draw(camera, {.halo_px = 0}), 0);
    const EyeView view = viewOf(camera, size_.aspect());
    const ScreenPoint middle = project(view, far_W + Vector3d(12, 9, 0), size_);
    const double radius_px = 8 * pixelsPerRadian(view.frustum, size_) / 100;
    EXPECT_NEAR(seen.x, middle.x, 0.5);
    EXPECT_NEAR(seen.y, middle.y, 0.5);
    EXPECT_NEAR(seen.count / (std::numbers::pi * radius_px * radius_px), 1, 0.05);
    EXPECT_EQ(figures_.cones, 1u);
  }
}

TEST_F(Renderers, WhatIsNearerHidesWhatIsFarther) {
  renderer_.put(1, ball(0, 0, 0, 8, kRed));
  renderer_.put(2, ball(0, 0, -30, 8, kGreen));
  Picture picture = draw(camera_);
  EXPECT_GT(litAreaOf(picture, 0).count, 300);
  EXPECT_EQ(litAreaOf(picture, 1).count, 0);
  renderer_.put(2, ball(0, 0, 30, 8, kGreen));  // replaces
  picture = draw(camera_);
  EXPECT_EQ(litAreaOf(picture, 0).count, 0);
  EXPECT_GT(litAreaOf(picture, 1).count, 300);
  renderer_.remove(2);
  EXPECT_EQ(renderer_.bytes(), sizeof(DrawnSegment));
  EXPECT_EQ(litAreaOf(draw(camera_), 1).count, 0);
}

// Two ends that differ by a nanometre make a cone of what would be a ball.
TEST_F(Renderers, SmallBallsAreDrawnAsConesWouldBe) {
  for (const double radius_um : {0.5, 1.0, 2.0, 3.0}) {
    SCOPED_TRACE(radius_um);
    const RenderOptions options{.fog_begin_um = 50, .fog_end_um = 150, .fog_most = 0.5};
    renderer_.put(2, neurites({{-30, 0, -20, 0.2, 30, 0, -20, 0.2}}, kGreen, Vector3d::Zero()));
    renderer_.put(1, ball(12, 1, 0, radius_um, kRed));
    const Picture flat = draw(camera_, options);
    renderer_.put(1, neurites({{12, 1, 0, radius_um, 12.001, 1, 0, radius_um}}, kRed, Vector3d::Zero()));
    const Picture round = draw(camera_, options);
    EXPECT_GT(litAreaOf(round, 0).count, 1);
    EXPECT_NEAR(litAreaOf(flat, 0).count, litAreaOf(round, 0).count, 2);
    EXPECT_NEAR(litAreaOf(flat, 1).count, litAreaOf(round, 1).count, 2) << "the halo cuts the neurite behind";
    int other = 0;
    for (std::size_t i = 0; i < flat.rgb.size(); ++i) other += std::abs(flat.rgb[i] - round.rgb[i]) > 8;
    EXPECT_LE(other, 6);
  }
}

TEST_F(Renderers, SmallBallsHideAndAreHidden) {
  const RenderOptions without_halo{.halo_px = 0};
  renderer_.put(1, ball(0, 0, 0, 2, kRed));
  renderer_.put(2, ball(0, 0, -30, 2, kGreen));
  Picture picture = draw(camera_, without_halo);
  EXPECT_GT(litAreaOf(picture, 0).count, 20);
  EXPECT_EQ(litAreaOf(picture, 1).count, 0);
  renderer_.put(2, neurites({{-30, 0, 20, 4, 30, 0, 20, 4}}, kGreen, Vector3d::Zero()));
  EXPECT_EQ(litAreaOf(draw(camera_, without_halo), 0).count, 0);
  renderer_.remove(2);
  EXPECT_EQ(litAreaOf(draw(camera_, {.clear_end_um = 150, .clear_begin_um = 200}), 0).count, 0);
  renderer_.remove(1);
  const Picture empty = draw(camera_);
  for (const double x : {0.0, 0.1, 0.2, 0.3, 0.4, 0.5}) {
    renderer_.put(1, ball(x, 0.7 * x, 0, 0.01, kRed));
    EXPECT_NE(draw(camera_).rgb, empty.rgb) << "a ball below a pixel is seen wherever it is: " << x;
  }
}

// A segment has the right length and width, and joints leave no gaps.
TEST_F(Renderers, ConesTaper) {
  renderer_.put(1, neurites({{-30, 0, 0, 6, 30, 0, 0, 2}}, kRed, Vector3d::Zero()));
  const LitArea seen = litAreaOf(draw(camera_, {.halo_px = 0}), 0);
  const double px_um = pixelsPerRadian(viewOf(camera_, size_.aspect()).frustum, size_) / 100;
  const double area_um2 = 60 * (6 + 2) + std::numbers::pi / 2 * (36 + 4);
  EXPECT_NEAR(seen.count / (area_um2 * px_um * px_um), 1, 0.06);
}

TEST_F(Renderers, ThinThreadsAreLinesAndAreSeen) {
  renderer_.put(1, neurites({{-20, 0, 0, 0.01, 20, 0, 0, 0.01}, {0, 10, 0, 4, 0, 10, 0, 4}}, kGreen, Vector3d::Zero()));
  const Picture picture = draw(camera_);
  EXPECT_EQ(figures_.lines, 1u);
  EXPECT_EQ(figures_.cones, 1u);
  const EyeView view = viewOf(camera_, size_.aspect());
  const double from = project(view, {-19, 0, 0}, size_).x, to = project(view, {19, 0, 0}, size_).x;
  for (double x = from; x < to; x += 1) {
    int strongest = 0;
    for (int y = size_.height / 2 - 2; y <= size_.height / 2 + 1; ++y)
      strongest = std::max<int>(strongest,
                                picture.rgb[3 * static_cast<std::size_t>(y * size_.width + static_cast<int>(x)) + 1]);
    EXPECT_GT(strongest, 60) << x;
  }
}

TEST_F(Renderers, BatchesOutsideThePictureAreCulled) {
  renderer_.put(1, ball(500, 0, 0, 8, kRed));
  renderer_.put(2, ball(0, 0, 200, 8, kRed));
  draw(camera_);
  EXPECT_EQ(figures_.culled, 2u);
  EXPECT_EQ(figures_.batches, 0u);
}

TEST_F(Renderers, FogFadesAndClearingUncovers) {
  renderer_.put(1, ball(0, 0, 0, 8, kRed));
  const double clear = litAreaOf(draw(camera_), 0).count;
  EXPECT_GT(clear, 300);
  EXPECT_EQ(litAreaOf(draw(camera_, {.fog_begin_um = 10, .fog_end_um = 50, .fog_most = 1}), 0).count, 0);
  EXPECT_EQ(litAreaOf(draw(camera_, {.clear_end_um = 150, .clear_begin_um = 200}), 0).count, 0);
  renderer_.put(1, ball(0, 0, 0, 8, kRed), Layer::overlays);  // neither applies to overlays
  EXPECT_NEAR(litAreaOf(draw(camera_, {.fog_begin_um = 10, .fog_end_um = 50, .fog_most = 1}), 0).count, clear, 20);
  EXPECT_NEAR(litAreaOf(draw(camera_, {.clear_end_um = 150, .clear_begin_um = 200}), 0).count, clear, 20);
}

TEST_F(Renderers, HalosCutWhatLiesBehind) {
  renderer_.put(1, neurites({{0, -30, 20, 1, 0, 30, 20, 1}}, kRed, Vector3d::Zero()));
  renderer_.put(2, neurites({{-30, 0, -20, 1, 30, 0, -20, 1}}, kGreen, Vector3d::Zero()));
  const double without = litAreaOf(draw(camera_, {.halo_px = 0}), 1).count;
  const double with = litAreaOf(draw(camera_, {.halo_px = 4}), 1).count;
  EXPECT_LT(with, without - 10);
  EXPECT_GT(with, 0.7 * without);
}

// Cones, lines and balls behind a cone or a ball.
TEST_F(Renderers, ACellCastsNoHaloOnItself) {
  const Rgba own{40, 200, 60, kRed.a};
  for (const double front_um : {1.0, 4.0})
    for (const double behind_um : {0.01, 1.0, 12.0}) {
      SCOPED_TRACE(std::to_string(front_um) + " before " + std::to_string(behind_um));
      const bool is_ball = behind_um > 10;
      const auto behind = [&](const Rgba& colour) {
        return is_ball ? ball(0, 0, -20, behind_um, colour)
                       : neurites({{-30, 0, -20, behind_um, 30, 0, -20, behind_um}}, colour, Vector3d::Zero());
      };
      renderer_.put(1, is_ball ? neurites({{0, -30, 20, front_um, 0, 30, 20, front_um}}, kRed, Vector3d::Zero())
                               : ball(0, 0, 20, front_um, kRed));
      renderer_.put(2, behind(own));
      const double without = litAreaOf(draw(camera_, {.halo_px = 0}), 1).count;
      EXPECT_EQ(litAreaOf(draw(camera_, {.halo_px = 4}), 1).count, without);
      renderer_.put(2, behind(kGreen));
      EXPECT_LT(litAreaOf(draw(camera_, {.halo_px = 4}), 1).count, without - 2);
    }
}

TEST_F(Renderers, MarksAreSeenFaintlyThroughThreads) {
  renderer_.put(1, ball(0, 0, 30, 10, kGreen));
  renderer_.put(2, ball(0, 0, 0, 5, kRed), Layer::overlays);
  const Picture picture = draw(camera_);
  const std::uint8_t* middle = &picture.rgb[3 * static_cast<std::size_t>(100 * 320 + 160)];
  EXPECT_GT(middle[0], 70);
  EXPECT_GT(middle[1], middle[0]);
}

TEST_F(Renderers, HiddenBatchesAreLeftOut) {
  renderer_.put(1, ball(0, 0, 0, 8, kRed));
  renderer_.show(1, false);
  EXPECT_EQ(litAreaOf(draw(camera_), 0).count, 0);
  EXPECT_EQ(figures_.batches, 0u);
  renderer_.show(1, true);
  renderer_.show(2, true);  // unknown id
  EXPECT_GT(litAreaOf(draw(camera_), 0).count, 300);
}

TEST_F(Renderers, HighlightsAreSeenThroughOthersWhichRecede) {
  renderer_.put(1, ball(0, 0, 30, 10, kGreen));
  const double before = litAreaOf(draw(camera_), 1).count;
  renderer_.put(2, neurites({{-30, 0, 0, 0.01, 30, 0, 0, 0.01}}, kRed, Vector3d::Zero()), Layer::highlight);
  const Picture picture = draw(camera_, {.fog_begin_um = 10, .fog_end_um = 50, .fog_most = 1, .dim = 0.9});
  const LitArea red = litAreaOf(picture, 0);
  EXPECT_GT(red.count, 30 * pixelsPerRadian(viewOf(camera_, size_.aspect()).frustum, size_) / 100);
  const std::uint8_t* middle = &picture.rgb[3 * static_cast<std::size_t>(100 * 320 + 160)];
  EXPECT_GT(middle[0], middle[1]);  // through the ball
  EXPECT_LT(litAreaOf(picture, 1).count, before / 10);
}

// A highlighted cell is among the neurites too, dimmed. Thick or thin, its bright copy is the one to see.
TEST_F(Renderers, AHighlightCoversItsDimmedCopy) {
  const auto brightness = [&](const NeuriteBatch& cell, bool dimmed_copy) {
    renderer_.remove(1);
    if (dimmed_copy) renderer_.put(1, cell);
    renderer_.put(2, cell, Layer::highlight);
    const Picture picture = draw(camera_, {.dim = 0.9, .halo_px = 0});
    double sum = 0;
    for (std::size_t at = 0; at < picture.rgb.size(); at += 3) sum += picture.rgb[at];
    return sum;
  };
  for (const double radius_um : {8.0, 0.01}) {
    const NeuriteBatch cell = neurites({{-30, 0, 5, radius_um, 30, 3, 0, radius_um}}, kRed, Vector3d::Zero());
    const double alone = brightness(cell, false);
    EXPECT_NEAR(brightness(cell, true), alone, 0.02 * alone) << radius_um;
    EXPECT_EQ(figures_.cones, radius_um > 1 ? 2u : 0u);  // thin ones are lines
  }
}

TEST_F(Renderers, WhatHasSomethingNearerBesideItIsShaded) {
  renderer_.put(1, neurites({{-60, 0, -40, 20, 60, 0, -40, 20}}, kGreen, Vector3d::Zero()));
  renderer_.put(2, ball(0, 0, 30, 5, kRed));
  const auto brightness = [](const Picture& p, int x, int y) {
    return p.rgb[3 * static_cast<std::size_t>(y * p.width + x) + 1];
  };
  const Picture plain = draw(camera_, {.halo_px = 0}), shaded = draw(camera_, {.halo_px = 0, .shade_um = 10});
  const LitArea ball_px = litAreaOf(plain, 0);
  const int beside = static_cast<int>(ball_px.x + std::sqrt(ball_px.count / std::numbers::pi) + 1.5);
  EXPECT_LT(brightness(shaded, beside, 100), 0.8 * brightness(plain, beside, 100));
  EXPECT_NEAR(brightness(shaded, beside + 60, 100), brightness(plain, beside + 60, 100), 3);  // far away: unchanged
}

// Neurites between the camera and the focus get thinner, without a pattern of dots.
TEST_F(Renderers, ClearedThreadsTaper) {
  renderer_.put(1, neurites({{-30, 0, 20, 6, 30, 0, 20, 6}}, kRed, Vector3d::Zero()));
  const double whole = litAreaOf(draw(camera_, {.halo_px = 0}), 0).count;
  const Picture half = draw(camera_, {.clear_end_um = 70, .clear_begin_um = 90, .halo_px = 0});  // it is 80 away
  EXPECT_NEAR(litAreaOf(half, 0).count / whole, 0.5, 0.12);
  // Each column has one run of red.
  for (int x = 120; x < 200; ++x) {
    int runs = 0;
    bool red = false;
    for (int y = 0; y < 200; ++y) {
      const std::uint8_t* p = &half.rgb[3 * static_cast<std::size_t>(y * 320 + x)];
      const bool now = p[0] >= p[1] + 30;
      runs += now && !red;
      red = now;
    }
    EXPECT_EQ(runs, 1) << x;
  }
}

// Lines that fade are mixed with what lies behind, without a pattern of dots, and hide nothing.
TEST_F(Renderers, LinesFadeEvenly) {
  renderer_.put(1, neurites({{-30, 0, 20, 0.01, 30, 0, 20, 0.01}}, kRed, Vector3d::Zero()));
  const auto redAt = [](const Picture& picture, int x) {
    int most = 0;
    for (int y = 95; y < 105; ++y)
      most = std::max<int>(most, picture.rgb[3 * static_cast<std::size_t>(y * picture.width + x)]);
    return most;
  };
  const Picture whole = draw(camera_),
                half = draw(camera_, {.clear_end_um = 70, .clear_begin_um = 90});  // it is 80 away
  const int ground = kDarkGround.r;
  for (int x = 120; x < 200; ++x)
    EXPECT_NEAR(redAt(half, x), ground + (redAt(whole, x) - ground) / 2, 10) << "at column " << x;
  renderer_.put(2, ball(0, 0, -20, 12, kGreen));
  const double hidden = litAreaOf(draw(camera_, {.clear_end_um = 79.9, .clear_begin_um = 90}), 1).count;
  renderer_.remove(1);
  EXPECT_NEAR(hidden, litAreaOf(draw(camera_), 1).count, 2);
}

TEST_F(Renderers, QuadBufferStereoNeedsAWindowThatHasIt) {
  EXPECT_FALSE(renderer_.hasQuadBuffer());
  EXPECT_THROW(draw(camera_, {.stereo = StereoMode::quad_buffer}), GraphicsError);
}

TEST_F(Renderers, StereoPutsEachEyeInItsPlace) {
  separation_ = 1.0 / 20;
  renderer_.put(1,
                ball(0, 0, 40, 5, kRed));  // in front of the plane of convergence: the left eye sees it farther right
  const auto views = stereoViews(camera_, 0.8, separation_);
  const Picture pair = draw(camera_, {.stereo = StereoMode::side_by_side});
  const PictureSize eye = eyeSize(StereoMode::side_by_side, size_);
  double x[2] = {0, 0}, n[2] = {0, 0};
  for (int py = 0; py < 200; ++py)
    for (int px = 0; px < 320; ++px) {
      const std::uint8_t* p = &pair.rgb[3 * static_cast<std::size_t>(py * 320 + px)];
      if (p[0] < p[1] + 30) continue;
      x[px >= 160] += px % 160 + 0.5;
      n[px >= 160] += 1;
    }
  ASSERT_GT(n[0], 50);
  ASSERT_GT(n[1], 50);
  for (int side = 0; side < 2; ++side)
    EXPECT_NEAR(x[side] / n[side], project(views[static_cast<std::size_t>(side)], {0, 0, 40}, eye).x, 0.5);
  EXPECT_GT(x[0] / n[0], x[1] / n[1] + 2);

  // The left eye's rows, and its red, show the ball where that eye sees it.
  const auto whole = stereoViews(camera_, 1.6, separation_);
  const Picture rows = draw(camera_, {.stereo = StereoMode::row_interleaved});
  const auto redIn = [&](int parity) {
    double sum = 0, count = 0;
    for (int py = parity; py < 200; py += 2)
      for (int px = 0; px < 320; ++px) {
        const std::uint8_t* p = &rows.rgb[3 * static_cast<std::size_t>(py * 320 + px)];
        if (p[0] >= p[1] + 30) sum += px + 0.5, count += 1;
      }
    return sum / count;
  };
  EXPECT_NEAR(redIn(0), project(whole[0], {0, 0, 40}, size_).x, 0.5);
  EXPECT_NEAR(redIn(1), project(whole[1], {0, 0, 40}, size_).x, 0.5);

  const Picture above = draw(camera_, {.stereo = StereoMode::top_bottom});
  EXPECT_NEAR(litAreaOf(above, 0).y, 100, 1);

  renderer_.put(1, proxyBatch({0, 0, 40}, 5));  // white
  const Picture anaglyph = draw(camera_, {.stereo = StereoMode::anaglyph});
  const LitArea red = litAreaOf(anaglyph, 0);
  EXPECT_GT(red.count, 5);
  EXPECT_GT(red.x, project(whole[1], {0, 0, 40}, size_).x);
}

TEST_F(Renderers, TheSamePictureTwice) {
  renderer_.put(1, neurites({{-30, -5, 0, 3, 30, 10, -20, 1}}, kRed, Vector3d::Zero()));
  EXPECT_EQ(draw(camera_).rgb, draw(camera_).rgb);
}

TEST_F(Renderers, SmallestPictureAndRefusedSizes) {
  renderer_.put(1, ball(0, 0, 0, 50, kRed));
  size_ = {1, 1};
  for (const StereoMode stereo : kStereoModes) EXPECT_EQ(draw(camera_, {.stereo = stereo}).rgb.size(), 3u);
  size_ = {0, 10};
  EXPECT_THROW(draw(camera_), UsageError);
  size_ = {10, Renderer::kMaxSize + 1};
  EXPECT_THROW(draw(camera_), UsageError);
}

// The part behind the eye is not drawn. The part in front is drawn where it is alone.
TEST_F(Renderers, EyesInsideThreadsSeeWhatIsBeforeThem) {
  renderer_.put(1, neurites({{0, 0, 90, 20, 0, 0, 110, 20}, {0, 0, 110, 30, 0, 0, 150, 30}}, kRed, Vector3d::Zero()));
  renderer_.put(
      2, neurites({{-20, 8, 0, 0.01, 20, 8, 0, 0.01}, {3, 8, 150, 0.01, -3, 8, 0, 0.01}}, kGreen, Vector3d::Zero()));
  renderer_.put(3, ball(0, -8, 0, 4, kGreen));
  const Picture inside = draw(camera_, {.clear_end_um = 20, .clear_begin_um = 60, .halo_px = 0});
  for (const Renderer::BatchId id : {1, 2}) renderer_.remove(id);
  renderer_.put(2, neurites({{-20, 8, 0, 0.01, 20, 8, 0, 0.01}}, kGreen, Vector3d::Zero()));
  const Picture alone = draw(camera_, {.halo_px = 0});
  EXPECT_EQ(litAreaOf(inside, 0).count, 0);
  const LitArea all = litAreaOf(inside, 1), less = litAreaOf(alone, 1);
  EXPECT_GE(all.count, less.count);
  EXPECT_LT(all.count, less.count + 250);  // the neurite that comes from behind is a line, too
}

// Lines have the stated width in all directions, whatever width the driver gives its own lines.
TEST_F(Renderers, LinesAreAPixelWide) {
  for (const double turn_rad : {0.0, 0.4, 0.8, 1.5}) {
    const double x = 30 * std::cos(turn_rad), y = 30 * std::sin(turn_rad);
    renderer_.put(1, neurites({{-x, -y, 0, 0.01, x, y, 0, 0.01}}, kGreen, Vector3d::Zero()));
    const Picture picture = draw(camera_, {.samples = 1});
    const EyeView view = viewOf(camera_, size_.aspect());
    const ScreenPoint a = project(view, {-x, -y, 0}, size_), b = project(view, {x, y, 0}, size_);
    const double advances = std::max(std::abs(b.x - a.x), std::abs(b.y - a.y));
    EXPECT_NEAR(litAreaOf(picture, 1).count / advances, 1, 0.05) << turn_rad;
    // Two samples across a pixel: two samples wide.
    EXPECT_NEAR(litAreaOf(draw(camera_, {.samples = 2}), 1).count / advances, 1.5, 0.6) << turn_rad;
  }
}

TEST_F(Renderers, APaletteDrawsThePaintedColours) {
  NeuriteBatch batch = ball(0, 3, 0, 20, {}, {0, 40, 0});
  batch.by_cell = true;
  batch.tile = 12;
  camera_ = lookAt({0, 40, 100}, {0, 40, 0});
  CellPalette palette = makePalette(2600, ColourBy::cell, nullptr, nullptr);  // more than a row
  palette.shallow_um = 100, palette.deep_um = 0;
  const auto drawnOf = [&](const NeuriteBatch& shown) {
    renderer_.put(1, shown);
    return draw(camera_).rgb;
  };
  for (const ColourBy colour : kColourings)
    for (const auto& [cell, type] : {std::pair{3U, 2}, std::pair{2500U, 4}}) {
      palette.colour = colour;
      renderer_.paint(palette);
      batch.segments[0].paint = ownerPaint(cell, static_cast<std::uint16_t>(type));
      NeuriteBatch same = batch;
      same.by_cell = false;
      Rgba own = paintedColour(batch.segments[0], batch, palette);
      own.a = markOfCell(cell);
      same.segments[0].paint = paintOf(own);
      const auto by_palette = drawnOf(batch), by_colour = drawnOf(same);
      int most = 0;
      for (std::size_t i = 0; i < by_colour.size(); ++i) most = std::max(most, std::abs(by_palette[i] - by_colour[i]));
      EXPECT_LE(most, 1) << toString(colour) << " of cell " << cell;
    }
}

}  // namespace
}  // namespace filiform::test
