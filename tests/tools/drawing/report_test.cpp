#include "tools/drawing/report.h"

#include "index/errors.h"
#include "tests/support/numbers.h"
#include "tests/support/temp_folder.h"
#include "tools/drawing/image_font.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <signal.h>
#include <sys/resource.h>

#include <gtest/gtest.h>
#include <png.h>

namespace filiform::tools {
namespace {

using test::kInfinity;
using test::kNaN;

Image readPng(const std::string& path) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  EXPECT_NE(png_image_begin_read_from_file(&png, path.c_str()), 0) << png.message;
  png.format = PNG_FORMAT_RGB;
  Image image(static_cast<int>(png.width), static_cast<int>(png.height));
  EXPECT_NE(png_image_finish_read(&png, nullptr, image.rgb.data(), 0, nullptr), 0) << png.message;
  return image;
}

// The number of pixels that differ from `colour` by less than `within` in every channel.
int count(const Image& image, Colour colour, int within = 30) {
  int n = 0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const Colour c = image.at(x, y);
      n += std::abs(c.r - colour.r) <= within && std::abs(c.g - colour.g) <= within &&
           std::abs(c.b - colour.b) <= within;
    }
  }
  return n;
}

TEST(WritePng, ReadsBackPixelForPixel) {
  const test::TempFolder folder;
  Image image(37, 21);
  for (std::size_t i = 0; i < image.rgb.size(); ++i) image.rgb[i] = static_cast<std::uint8_t>(i * 7);
  writePng(image, folder.file("a.png"));
  const Image back = readPng(folder.file("a.png"));
  EXPECT_EQ(back.width, 37);
  EXPECT_EQ(back.rgb, image.rgb);
}

TEST(WritePng, LeavesNothingHalfWritten) {
  const test::TempFolder folder;
  Image image(400, 400);
  unsigned noise = 1;
  for (auto& byte : image.rgb) byte = static_cast<std::uint8_t>((noise = noise * 1664525U + 1013904223U) >> 24);
  EXPECT_THROW(writePng(image, folder.file("no/such/folder.png")), IoError);
  const auto old_handler = signal(SIGXFSZ, SIG_IGN);
  rlimit old_limit{};
  getrlimit(RLIMIT_FSIZE, &old_limit);
  const rlimit small{10000, old_limit.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  EXPECT_THROW(writePng(image, folder.file("a.png")), IoError);
  setrlimit(RLIMIT_FSIZE, &old_limit);
  signal(SIGXFSZ, old_handler);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(Canvas, ALineCoversItsAreaOnceAndBlendsAtItsEdges) {
  Image image(100, 60);
  Canvas canvas(image);
  canvas.line({20, 30}, {80, 30}, 4, {0, 0, 0});
  EXPECT_EQ(image.at(50, 29), (Colour{0, 0, 0}));
  EXPECT_EQ(image.at(50, 35), kWhite);
  // Coverage adds up to the area: 60 x 4 and two round ends.
  double ink = 0;
  for (int y = 0; y < 60; ++y)
    for (int x = 0; x < 100; ++x) ink += 1 - image.at(x, y).r / 255.0;
  EXPECT_NEAR(ink, 60 * 4 + 3.14159 * 4, 3);
  // A shape that crosses itself has its own colour everywhere.
  Image crossing(60, 60);
  Canvas on(crossing);
  on.polyline({{10, 10}, {50, 50}, {10, 50}, {50, 10}}, 6, {0, 0, 0}, 0.5);
  EXPECT_NEAR(crossing.at(30, 30).r, 128, 1);
}

TEST(Canvas, ClipsAndIgnoresWhatIsNotFinite) {
  Image image(50, 50);
  Canvas canvas(image);
  canvas.clip(10, 10, 40, 40);
  canvas.line({-1e9, 25}, {1e9, 25}, 3, {0, 0, 0});
  canvas.line({kNaN, 0}, {20, 20}, 3, {255, 0, 0});
  canvas.line({0, 0}, {kInfinity, 20}, 3, {255, 0, 0});
  canvas.fill(-100, 30, 100, 35, {0, 0, 255});
  canvas.dashes({0, 15}, {kInfinity, 15}, 1, {255, 0, 0}, 2, 2);
  canvas.disc({1e300, 3}, 5, {255, 0, 0});
  EXPECT_EQ(count(image, {255, 0, 0}), 0);
  EXPECT_EQ(image.at(9, 25), kWhite);
  EXPECT_EQ(image.at(40, 25), kWhite);
  EXPECT_EQ(image.at(10, 25), (Colour{0, 0, 0}));
  EXPECT_EQ(image.at(39, 32), (Colour{0, 0, 255}));
  EXPECT_EQ(image.at(9, 32), kWhite);
}

TEST(Canvas, TheFontHasEveryCharacterItClaims) {
  std::size_t glyphs = 0;
  for (const auto& line : font::kLines) {
    const auto bars = [](std::string_view row) { return std::count(row.begin(), row.end(), '|'); };
    for (const std::string_view row : line) {
      EXPECT_EQ(row.size(), line[0].size());
      EXPECT_EQ(bars(row), bars(line[0]));
      EXPECT_EQ(row.find_first_not_of("#.|"), std::string_view::npos);
    }
    glyphs += static_cast<std::size_t>(bars(line[0])) + 1;
  }
  EXPECT_EQ(glyphs, font::kCharacters.size());
  // Different characters look different, and all except the blank are visible.
  std::vector<std::vector<std::uint8_t>> seen;
  for (char c = '!'; c <= '~'; ++c) {
    Image image(30, 30);
    Canvas(image).text(std::string(1, c), {8, 20}, 12, {0, 0, 0});
    EXPECT_GT(count(image, {0, 0, 0}, 120), 2) << c;
    EXPECT_EQ(std::find(seen.begin(), seen.end(), image.rgb), seen.end()) << c;
    seen.push_back(image.rgb);
  }
}

TEST(Canvas, TextIsUtf8AndSurvivesAnythingElse) {
  EXPECT_GT(Canvas::textWidth("µm", 10), Canvas::textWidth("m", 10));
  EXPECT_EQ(Canvas::textWidth("", 10), 0);
  EXPECT_DOUBLE_EQ(Canvas::textWidth("\xff", 10), Canvas::textWidth("?", 10));
  EXPECT_DOUBLE_EQ(Canvas::textWidth("\xe4\xb8\xad", 10), Canvas::textWidth("?", 10)) << "not in the font";
  EXPECT_DOUBLE_EQ(Canvas::textWidth("\xc2", 10), Canvas::textWidth("?", 10)) << "cut short";
  Image image(60, 60);
  Canvas canvas(image);
  canvas.text("Ag", {10, 30}, 12, {0, 0, 0}, Align::left, true);
  canvas.text(std::string(200, 'x'), {-500, 1e6}, 12, {0, 0, 0});
  EXPECT_GT(count(image, {0, 0, 0}, 100), 10);
}

TEST(NiceTicks, AreRoundAndWithinTheRange) {
  EXPECT_EQ(niceTicks(0, 10, 5), (std::vector<double>{0, 2, 4, 6, 8, 10}));
  for (const auto& [lo, hi] : {std::pair{-3.7, 912.4}, {1e-9, 2e-9}, {-1e12, 1e13}, {99.5, 100.5}, {-0.3, 0.1}}) {
    const std::vector<double> ticks = niceTicks(lo, hi, 6);
    EXPECT_GE(ticks.size(), 3U) << lo << " " << hi;
    EXPECT_LE(ticks.size(), 9U) << lo << " " << hi;
    EXPECT_GE(ticks.front(), lo - (hi - lo) * 1e-6);
    EXPECT_LE(ticks.back(), hi + (hi - lo) * 1e-6);
    const double step = ticks[1] - ticks[0];
    const double digit = step / std::pow(10, std::floor(std::log10(step) + 1e-6));
    EXPECT_LT(std::min({std::abs(digit - 1), std::abs(digit - 2), std::abs(digit - 5)}), 1e-3) << step;
  }
}

TEST(TickLabel, HasTheDecimalsOfItsStep) {
  EXPECT_EQ(tickLabel(0, 0.1), "0");
  EXPECT_EQ(tickLabel(0.30000000000000004, 0.1), "0.3");
  EXPECT_EQ(tickLabel(2, 0.05), "2.00");
  EXPECT_EQ(tickLabel(-1.5, 0.5), "−1.5");
  EXPECT_EQ(tickLabel(1500, 500), "1500");
  EXPECT_EQ(tickLabel(150000, 50000), "150 000");
  EXPECT_EQ(tickLabel(1e8, 1e8), "1e8");
  EXPECT_EQ(tickLabel(2.5e-7, 1e-7), "2.5·1e−7");
}

Plot waves(std::size_t n) {
  Plot plot;
  plot.title = "Force at the hand";
  plot.x_label = "time (s)";
  plot.y_label = "force (N)";
  PlotSeries series{"force-based", {}, {}};
  for (std::size_t i = 0; i < n; ++i) {
    series.x.push_back(static_cast<double>(i) * 1e-3);
    series.y.push_back(1 + 0.2 * std::sin(static_cast<double>(i) * 1e-2));
  }
  plot.series.push_back(series);
  return plot;
}

TEST(DrawPlot, ShowsTheDataInThePalette) {
  const Image image = drawPlot(waves(1000));
  EXPECT_EQ(image.width, 1200);
  EXPECT_EQ(image.height, 500);
  EXPECT_GT(count(image, seriesColour(0)), 1000);
  EXPECT_EQ(image.at(0, 0), kWhite);
  EXPECT_EQ(image.at(1199, 499), kWhite);
}

TEST(DrawPlot, WhatLiesOnABroadSeriesIsSeenWhicheverComesFirst) {
  for (const std::size_t broad : {0u, 1u}) {
    Plot plot;
    plot.series = {{"a", {0, 1, 2}, {1, 2, 3}}, {"b", {0, 1, 2}, {1, 2, 3}}};
    plot.series[broad].broad = true;
    const Image image = drawPlot(plot);
    EXPECT_GT(count(image, seriesColour(1 - broad), 70), 500) << broad;
  }
}

TEST(DrawPlot, KeepsASinglePeakAmongAMillionPoints) {
  Plot plot = waves(1'000'000);
  Plot without = plot;
  plot.series[0].y[345'678] = 9;
  without.series[0].y[345'678] = 1;
  plot.y_from_zero = without.y_from_zero = false;
  // The peak sets the scale; a line must lead up to it.
  const Image image = drawPlot(plot);
  int top = image.height;
  for (int y = image.height; y-- > 0;)
    for (int x = 100; x < image.width; ++x)
      if (const Colour c = image.at(x, y); c.b > c.r + 60) top = y;
  EXPECT_LT(top, 90);
  EXPECT_NE(image.rgb, drawPlot(without).rgb);
}

// A point is drawn exactly if it is finite and, on logarithmic axes, positive.
TEST(DrawPlot, DrawsThePointsThatAreThereOfAnyData) {
  const std::vector<std::pair<std::vector<double>, std::vector<double>>> cases{
      {{}, {}},
      {{1}, {1}},
      {{0}, {0}},
      {{1, 2, 3}, {kNaN, kInfinity, -kInfinity}},
      {{kNaN, kInfinity, -kInfinity}, {1, 2, 3}},
      {{1, 2, 3, 4, 5}, {1, 2, kNaN, 2, 1}},
      {{-1e308, 1e308}, {-1e308, 1e308}},
      {{5, 5, 5}, {1e-320, 0, 1e-320}},
      {{1e15, 1e15 + 1}, {1e9, 1e9}},
      {{3, 1, 2}, {1, 2, 3}},
      {{0, -1, 10}, {0, -5, 1e-300}},
  };
  for (std::size_t i = 0; i < cases.size(); ++i) {
    for (const bool log : {false, true}) {
      SCOPED_TRACE("case " + std::to_string(i) + (log ? ", logarithmic" : ""));
      const auto& [x, y] = cases[i];
      std::size_t points = 0;
      for (std::size_t k = 0; k < x.size(); ++k)
        points += std::isfinite(x[k]) && std::isfinite(y[k]) && (!log || (x[k] > 0 && y[k] > 0));
      Plot plot;
      plot.x_log = plot.y_log = log;
      plot.width = 300;
      plot.height = 200;
      plot.series = {{"", x, y, true}};
      plot.lines = {{1.5, "mark"}, {kNaN, "nowhere"}};
      const Image image = drawPlot(plot);
      EXPECT_EQ(image.width, 300);
      EXPECT_EQ(image.height, 200);
      if (points > 0)
        EXPECT_GT(count(image, seriesColour(0)), 5);
      else
        EXPECT_EQ(count(image, seriesColour(0)), 0);
      for (const auto& [column, row] : {std::pair(0, 0), {299, 0}, {0, 199}, {299, 199}})
        EXPECT_EQ(image.at(column, row), kWhite);
    }
  }
}

TEST(DrawPlot, RefusesSeriesOfTwoLengthsAndAbsurdSizes) {
  Plot plot = waves(10);
  plot.series[0].y.pop_back();
  EXPECT_THROW(drawPlot(plot), UsageError);
  plot = waves(10);
  plot.width = 100;
  EXPECT_THROW(drawPlot(plot), UsageError);
  plot.width = 100'000;
  EXPECT_THROW(drawPlot(plot), UsageError);
}

ProjectionOptions view() {
  ProjectionOptions options;
  options.title = "A column";
  options.lo_um = {-100, 0, -100};
  options.hi_um = {100, 400, 100};
  options.height = 700;
  return options;
}

TEST(ProjectionPicture, YPointsUpAndThePathLiesOnTop) {
  ProjectionPicture picture(view());
  for (int i = 0; i < 200; ++i)
    picture.addSegment(static_cast<std::uint64_t>(i), {-100, i * 2.0, 0}, {100, i * 2.0, 0}, 3, 1);
  picture.addPath({{0, 50, 0}, {0, 200, 0}, {0, 350, 0}});
  const Image image = picture.finish();
  const Colour path{213, 60, 0};
  int first = -1, last = -1;
  for (int y = 0; y < image.height - 60; ++y) {
    if (std::abs(image.at(image.width / 2, y).r - path.r) < 20 &&
        std::abs(image.at(image.width / 2, y).g - path.g) < 20) {
      first = first < 0 ? y : first;
      last = y;
    }
  }
  // 556 rows for 400 um: y = 350 um is high up, y = 50 um low down.
  EXPECT_NEAR(first, 88 + 50 * 1.39, 8);
  EXPECT_NEAR(last, 88 + 350 * 1.39, 12);
}

TEST(ProjectionPicture, DoesNotDependOnTheOrderOfSegments) {
  const auto draw = [](bool backwards) {
    ProjectionPicture picture(view());
    for (int k = 0; k < 300; ++k) {
      const int i = backwards ? 299 - k : k;
      // Each segment has its own depth, so that no two are equally strong.
      picture.addSegment(static_cast<std::uint64_t>(i % 7), {-90.0 + i % 50, 10.0 + i, -90 + i * 0.6},
                         {90.0 - i % 31, 390.0 - i, -90 + i * 0.6});
    }
    return picture.finish();
  };
  const Image a = draw(false);
  const Image b = draw(true);
  int different = 0;
  for (int y = 0; y < a.height; ++y)
    for (int x = 0; x < a.width; ++x) different += a.at(x, y) == b.at(x, y) ? 0 : 1;
  EXPECT_LT(different, a.width * a.height / 1000) << "equal strengths aside";
}

TEST(ProjectionPicture, SurvivesFlatEmptyAndBrokenInput) {
  ProjectionOptions flat = view();
  flat.lo_um = flat.hi_um = {5, 5, 5};
  flat.levels = syntheticLevels();
  ProjectionPicture point(flat);
  point.addSegment(0, {5, 5, 5}, {5, 5, 5});
  point.addSegment(0, {kNaN, 5, 5}, {5, 5, 5});
  point.addSoma(0, {5, kInfinity, 5}, 1);
  point.addSoma(0, {5, 5, 5}, kNaN);
  point.addPath({});
  point.addPath({{5, 5, 5}});
  point.addPath({{kNaN, 5, 5}, {5, 5, 5}, {kNaN, 0, 0}, {1e300, 1e300, 0}});
  EXPECT_EQ(point.finish().height, 700);

  ProjectionOptions huge = view();
  huge.lo_um = {-1e9, -1e9, -1e9};
  huge.hi_um = {1e9, 1e9, 1e9};
  ProjectionPicture wide(huge);
  wide.addSegment(0, {-1e9, -1e9, 0}, {1e9, 1e9, 0});
  EXPECT_GT(count(wide.finish(), kWhite), 1000);

  ProjectionOptions bad = view();
  bad.hi_um.x() = kNaN;
  EXPECT_THROW(ProjectionPicture{bad}, UsageError);
  bad = view();
  bad.hi_um.y() = -1;
  EXPECT_THROW(ProjectionPicture{bad}, UsageError);
}

}  // namespace
}  // namespace filiform::tools
