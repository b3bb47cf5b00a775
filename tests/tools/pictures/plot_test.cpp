#include "tools/pictures/plot.h"

#include "index/errors.h"
#include "tests/support/golden.h"
#include "tests/support/numbers.h"
#include "tools/pictures/canvas.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

using test::colourAt;
using test::kInfinity;
using test::kNaN;

// The number of pixels that differ from `colour` by less than `within` in every channel.
int count(const Picture& picture, Rgba colour, int within = 30) {
  int n = 0;
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      const Rgba c = colourAt(picture, x, y);
      n += std::abs(c.r - colour.r) <= within && std::abs(c.g - colour.g) <= within &&
           std::abs(c.b - colour.b) <= within;
    }
  }
  return n;
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
  const Picture picture = drawPlot(waves(1000));
  EXPECT_EQ(picture.width, 1200);
  EXPECT_EQ(picture.height, 500);
  EXPECT_GT(count(picture, seriesColour(0)), 1000);
  EXPECT_EQ(colourAt(picture, 0, 0), kWhite);
  EXPECT_EQ(colourAt(picture, 1199, 499), kWhite);
}

TEST(DrawPlot, WhatLiesOnABroadSeriesIsSeenWhicheverComesFirst) {
  for (const std::size_t broad : {0u, 1u}) {
    Plot plot;
    plot.series = {{"a", {0, 1, 2}, {1, 2, 3}}, {"b", {0, 1, 2}, {1, 2, 3}}};
    plot.series[broad].broad = true;
    const Picture picture = drawPlot(plot);
    EXPECT_GT(count(picture, seriesColour(1 - broad), 70), 500) << broad;
  }
}

TEST(DrawPlot, KeepsASinglePeakAmongAMillionPoints) {
  Plot plot = waves(1'000'000);
  Plot without = plot;
  plot.series[0].y[345'678] = 9;
  without.series[0].y[345'678] = 1;
  plot.y_from_zero = without.y_from_zero = false;
  // The peak sets the scale; a line must lead up to it.
  const Picture picture = drawPlot(plot);
  int top = picture.height;
  for (int y = picture.height; y-- > 0;)
    for (int x = 100; x < picture.width; ++x)
      if (const Rgba c = colourAt(picture, x, y); c.b > c.r + 60) top = y;
  EXPECT_LT(top, 90);
  EXPECT_NE(picture.rgb, drawPlot(without).rgb);
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
      const Picture picture = drawPlot(plot);
      EXPECT_EQ(picture.width, 300);
      EXPECT_EQ(picture.height, 200);
      if (points > 0)
        EXPECT_GT(count(picture, seriesColour(0)), 5);
      else
        EXPECT_EQ(count(picture, seriesColour(0)), 0);
      for (const auto& [column, row] : {std::pair(0, 0), {299, 0}, {0, 199}, {299, 199}})
        EXPECT_EQ(colourAt(picture, column, row), kWhite);
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

// The number of runs of rows that have ink between two columns.
int inkedRows(const Picture& picture, int from, int to, int top, int bottom) {
  int runs = 0;
  bool before = false;
  for (int y = top; y < bottom; ++y) {
    bool inked = false;
    for (int x = from; x < to; ++x) inked = inked || colourAt(picture, x, y).g < 128;
    runs += inked && !before;
    before = inked;
  }
  return runs;
}

TEST(DrawPlot, MarksThatAreCloseStandInRowsAndInsideThePicture) {
  Plot plot;
  plot.series = {{"", {0, 1, 2, 100}, {5, 4, 1, 1}}};
  plot.lines = {{0, "exact, default, as it was read"}, {100, "the far end of the axis"}};
  EXPECT_EQ(inkedRows(drawPlot(plot), 0, plot.width, 0, 31), 1);
  plot.lines.push_back({1, "knee of the curve"});
  const Picture two = drawPlot(plot);
  EXPECT_EQ(inkedRows(two, 0, plot.width, 0, 46), 2);
  EXPECT_EQ(inkedRows(two, 0, 1, 0, plot.height), 0);
  EXPECT_EQ(inkedRows(two, plot.width - 1, plot.width, 0, plot.height), 0);
}

TEST(DrawPlot, ReachesToItsMarks) {
  Plot plot;
  plot.x_log = true;
  plot.series = {{"", {1, 10}, {5, 4}}};
  plot.lines = {{1000, "default"}};
  const Picture picture = drawPlot(plot);
  int last = 0;
  for (int y = 100; y < 400; ++y)
    for (int x = 0; x < picture.width; ++x)
      if (const Rgba c = colourAt(picture, x, y); c.b > c.r + 60) last = std::max(last, x);
  EXPECT_NEAR(last, picture.width / 3, 40);
}

TEST(DrawPlot, ALongTitleAndItsLegendDoNotMeet) {
  Plot plot;
  plot.width = 500;
  plot.title = "Short";
  plot.series = {{"first of two", {1, 2}, {5, 4}}, {"second of two", {1, 2}, {2, 3}}};
  EXPECT_EQ(inkedRows(drawPlot(plot), 40, 400, 30, 60), 0);
  plot.title = "A title that is nearly as long as the whole picture is wide";
  EXPECT_EQ(inkedRows(drawPlot(plot), 40, 400, 30, 60), 1);
}

TEST(DrawPlot, LogarithmicAxesWithinADecadeHaveLabels) {
  Plot plot;
  plot.y_log = true;
  plot.series = {{"", {1, 2, 3}, {30.5, 31, 33}}};
  EXPECT_GE(inkedRows(drawPlot(plot), 10, 30, 0, 460), 3);
}

TEST(SvgPlot, HasTheColoursOfItsSeries) {
  Plot plot = waves(10);
  const std::string one = svgPlot(plot);
  EXPECT_NE(one.find("viewBox=\"0 0 1200 500\""), std::string::npos);
  EXPECT_NE(one.find("rgb(0%,44.705882%,69.803922%)"), std::string::npos);
  EXPECT_EQ(one.find("rgb(83.529412%,36.862745%,0%)"), std::string::npos);
  plot.series.push_back(plot.series[0]);
  EXPECT_NE(svgPlot(plot).find("rgb(83.529412%,36.862745%,0%)"), std::string::npos);
  plot.width = 10;
  EXPECT_THROW(svgPlot(plot), UsageError);
}

}  // namespace
}  // namespace filiform::tools
