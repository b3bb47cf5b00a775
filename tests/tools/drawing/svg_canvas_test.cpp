#include "tools/drawing/svg_canvas.h"

#include "index/errors.h"
#include "tools/drawing/report.h"

#include <cmath>
#include <limits>
#include <regex>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

std::size_t occurrences(const std::string& text, const std::string& part) {
  std::size_t n = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
  return n;
}

TEST(SvgCanvas, NamesColoursOfThePaletteAndSpellsOthers) {
  SvgCanvas canvas(100, 50, "A <b>", "what & how");
  canvas.line({1, 2}, {3, 4.5}, 2, seriesColour(1));
  canvas.disc({5, 6}, 3, Colour{1, 2, 255});
  canvas.text("x < y", {7, 8}, 9, kInk, Align::right);
  canvas.text("up", {7, 8}, 9, kGrey, Align::centre, true);
  canvas.disc({std::nan(""), 6}, 3, kInk);
  const std::string svg = canvas.finish();
  EXPECT_EQ(svg.rfind("<svg ", 0), 0u);
  for (const char* part :
       {"viewBox=\"0 0 100 50\"", "<title>A &lt;b&gt;</title>", "<desc>what &amp; how</desc>", "class=\"k-s1\"",
        "points=\"1,2 3,4.5\"", "fill=\"#0102ff\"", "x &lt; y</text>", "text-anchor=\"end\"", "rotate(-90)"})
    EXPECT_NE(svg.find(part), std::string::npos) << part;
  EXPECT_EQ(occurrences(svg, "<circle"), 1u);
  EXPECT_EQ(svg.find("nan"), std::string::npos);
}

TEST(SvgCanvas, EveryClassIsInTheStyleLightAndDark) {
  SvgCanvas canvas(100, 50, "t", "d");
  for (std::size_t i = 0; i < seriesColours(); ++i) canvas.line({0, 0}, {1, 1}, 1, seriesColour(i));
  for (const Colour c : {kInk, kGrey, kWhite, kGridLine, kFinerGridLine}) canvas.disc({1, 1}, 1, c);
  const std::string svg = canvas.finish(), style = svgStyle();
  const std::regex name("class=\"([kf]-([a-z0-9]+))\"");
  int classes = 0;
  for (std::sregex_iterator it(svg.begin(), svg.end(), name), end; it != end; ++it, ++classes) {
    EXPECT_NE(style.find("." + (*it)[1].str() + " {"), std::string::npos) << (*it)[1];
    EXPECT_EQ(occurrences(style, "--" + (*it)[2].str() + ":"), 2u) << (*it)[2];
  }
  EXPECT_EQ(classes, static_cast<int>(seriesColours()) + 5);
}

TEST(SvgPlot, ShowsSeriesMarksLabelsAndClosesWhatItOpens) {
  Plot plot;
  plot.title = "Cost";
  plot.x_label = "error (um)";
  plot.y_label = "time (us)";
  plot.series = {{"one", {1, 10, 100}, {5, 4, 1}}, {"two", {1, 10, 100}, {2, std::nan(""), 1}}};
  plot.series[0].dots = true;
  plot.lines = {{10, "knee"}};
  plot.x_log = true;
  const std::string svg = svgPlot(plot, "described");
  for (const char* part : {"<title>Cost</title>", "described", "error (um)", "time (us)", "knee</text>", ">one</text>",
                           ">two</text>", "class=\"k-s0\"", "class=\"f-s1\""})
    EXPECT_NE(svg.find(part), std::string::npos) << part;
  for (const char* tag : {"g", "svg", "text", "clipPath"}) {
    EXPECT_EQ(occurrences(svg, std::string("<") + tag + " "), occurrences(svg, std::string("</") + tag + ">")) << tag;
  }
  // Two plots on one page do not share a clip.
  plot.title = "Other";
  const std::regex id("clipPath id=\"([^\"]+)\"");
  std::smatch a, b;
  const std::string other = svgPlot(plot, "described");
  ASSERT_TRUE(std::regex_search(svg, a, id) && std::regex_search(other, b, id));
  EXPECT_NE(a[1], b[1]);
  plot.width = 10;
  EXPECT_THROW(svgPlot(plot, ""), UsageError);
}

// The position, x and y, of a text.
Vector2d placeOf(const std::string& svg, const std::string& words) {
  const std::regex text("<text[^>]* x=\"([0-9.-]+)\" y=\"([0-9.-]+)\"[^>]*>([^<]*)</text>");
  for (std::sregex_iterator it(svg.begin(), svg.end(), text), end; it != end; ++it)
    if ((*it)[3] == words) return {std::stod((*it)[1]), std::stod((*it)[2])};
  ADD_FAILURE() << "no text says " << words;
  return {0, 0};
}

TEST(SvgPlot, MarksThatAreCloseStandInRowsAndInsideThePicture) {
  Plot plot;
  plot.series = {{"one", {0, 1, 2, 100}, {5, 4, 1, 1}}};
  plot.lines = {{0, "exact, default, as it was read"}, {1, "knee of the curve"}, {100, "the far end of the axis"}};
  const std::string svg = svgPlot(plot, "");
  const Vector2d first = placeOf(svg, plot.lines[0].label), second = placeOf(svg, plot.lines[1].label),
                 last = placeOf(svg, plot.lines[2].label);
  EXPECT_LE(second.y(), first.y() - 10);
  EXPECT_EQ(last.y(), first.y());
  const auto half = [](const std::string& text) { return 0.5 * SvgCanvas::textWidth(text, 8.5); };
  EXPECT_GE(first.x() - half(plot.lines[0].label), 0);
  EXPECT_LE(last.x() + half(plot.lines[2].label), plot.width);
}

TEST(SvgPlot, ReachesToItsMarks) {
  Plot plot;
  plot.x_log = true;
  plot.series = {{"one", {1, 10}, {5, 4}}};
  plot.lines = {{1000, "default"}};
  EXPECT_NE(svgPlot(plot, "").find(">1000</text>"), std::string::npos);
}

TEST(SvgPlot, ALongTitleAndItsLegendDoNotMeet) {
  Plot plot;
  plot.width = 500;
  plot.title = "A title that is nearly as long as the whole picture is wide";
  plot.series = {{"first of two", {1, 2}, {5, 4}}, {"second of two", {1, 2}, {2, 3}}};
  const std::string svg = svgPlot(plot, "");
  EXPECT_GE(placeOf(svg, "first of two").y(), placeOf(svg, plot.title).y() + 12);
  plot.title = "Short";
  const std::string beside = svgPlot(plot, "");
  EXPECT_EQ(placeOf(beside, "first of two").y(), placeOf(beside, "Short").y());
}

TEST(SvgPlot, LogarithmicAxesWithinADecadeHaveLabels) {
  Plot plot;
  plot.y_log = true;
  plot.series = {{"one", {1, 2, 3}, {30.5, 31, 33}}};
  const std::string svg = svgPlot(plot, "");
  EXPECT_NE(svg.find(">31.0</text>"), std::string::npos) << svg;
  EXPECT_NE(svg.find(">33.0</text>"), std::string::npos);
}

}  // namespace
}  // namespace filiform::tools
