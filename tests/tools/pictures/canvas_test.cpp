#include "tools/pictures/canvas.h"

#include "tests/support/golden.h"
#include "tests/support/numbers.h"

#include <algorithm>
#include <array>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

using test::colourAt;
using test::kInfinity;
using test::kNaN;

constexpr Rgba kBlack{0, 0, 0}, kRed{255, 0, 0}, kBlue{0, 0, 255};

// The area that black covers on white, pixels.
double ink(const Picture& picture) {
  double sum = 0;
  for (const std::uint8_t byte : picture.rgb) sum += 1 - byte / 255.0;
  return sum / 3;
}

TEST(Canvas, ALineCoversItsAreaOnce) {
  Picture picture = whitePicture(100, 60);
  Canvas(picture).line({20, 30}, {80, 30}, 4, kBlack);
  EXPECT_EQ(colourAt(picture, 50, 29), kBlack);
  EXPECT_EQ(colourAt(picture, 50, 35), kWhite);
  EXPECT_NEAR(ink(picture), 60 * 4, 1);
  // A shape that crosses itself has its own colour everywhere.
  Picture crossing = whitePicture(60, 60);
  Canvas(crossing).polyline({{10, 10}, {50, 50}, {10, 50}, {50, 10}}, 6, {0, 0, 0, 128});
  EXPECT_NEAR(colourAt(crossing, 30, 30).r, 127, 1);
}

TEST(Canvas, KeepsWhatThePictureHasAndReplacesWhatItCovers) {
  Picture picture = whitePicture(30, 20);
  picture.rgb[0] = 7;
  Canvas(picture).fill(9.8, 5, 20.2, 15, {10, 20, 30});
  EXPECT_EQ(colourAt(picture, 0, 0), (Rgba{7, 255, 255}));
  EXPECT_EQ(colourAt(picture, 10, 5), (Rgba{10, 20, 30}));
  EXPECT_EQ(colourAt(picture, 19, 14), (Rgba{10, 20, 30}));
  EXPECT_EQ(colourAt(picture, 9, 5), kWhite);
  EXPECT_EQ(colourAt(picture, 20, 5), kWhite);
}

TEST(Canvas, ClipsAndLeavesOutWhatIsNotFinite) {
  Picture picture = whitePicture(50, 50);
  {
    Canvas canvas(picture);
    canvas.clip(10, 10, 40, 40);
    canvas.line({-1e5, 25}, {1e5, 25}, 3, kBlack);
    canvas.line({kNaN, 0}, {20, 20}, 3, kRed);
    canvas.line({0, 0}, {kInfinity, 20}, 3, kRed);
    canvas.fill(-100, 30, 100, 35, kBlue);
    canvas.dashes({0, 15}, {kInfinity, 15}, 1, kRed, 2, 2);
    canvas.disc({1e300, 3}, 5, kRed);
    canvas.text("red", {20, kNaN}, 9, kRed);
    canvas.clipNothing();
    canvas.disc({45, 45}, 3, kBlack);
  }
  for (int y = 0; y < 50; ++y)
    for (int x = 0; x < 50; ++x) {
      const Rgba c = colourAt(picture, x, y);
      EXPECT_FALSE(c.r > c.b) << x << ' ' << y;
    }
  EXPECT_EQ(colourAt(picture, 9, 25), kWhite);
  EXPECT_EQ(colourAt(picture, 40, 25), kWhite);
  EXPECT_EQ(colourAt(picture, 10, 25), kBlack);
  EXPECT_EQ(colourAt(picture, 39, 32), kBlue);
  EXPECT_EQ(colourAt(picture, 9, 32), kWhite);
  EXPECT_EQ(colourAt(picture, 45, 45), kBlack);
}

TEST(Canvas, DashesHaveGaps) {
  Picture picture = whitePicture(100, 10);
  {
    Canvas canvas(picture);
    canvas.dashes({0, 5}, {100, 5}, 2, kBlack, 6, 4);
    canvas.line({0, 8.5}, {100, 8.5}, 1, kBlack);  // later lines have none
  }
  EXPECT_NEAR(ink(picture), 60 * 2 + 100, 1);
}

TEST(Canvas, TextHasItsHeightAndItsPlace) {
  const auto box = [](Align align, bool turned) {
    Picture picture = whitePicture(120, 120);
    Canvas(picture).text("HHH", {60, 60}, 12, kBlack, align, turned);
    std::array<int, 4> ends{120, 120, -1, -1};
    for (int y = 0; y < 120; ++y)
      for (int x = 0; x < 120; ++x)
        if (colourAt(picture, x, y).r < 128)
          ends = {std::min(ends[0], x), std::min(ends[1], y), std::max(ends[2], x), std::max(ends[3], y)};
    return ends;
  };
  const auto left = box(Align::left, false), centre = box(Align::centre, false), right = box(Align::right, false),
             up = box(Align::left, true);
  EXPECT_NEAR(left[3] - left[1] + 1, 12, 1);
  EXPECT_NEAR(left[3], 59, 1);
  EXPECT_GE(left[0], 60);
  EXPECT_NEAR(centre[0] + centre[2], 119, 2);
  EXPECT_LT(right[2], 60);
  EXPECT_NEAR(up[2] - up[0] + 1, 12, 1);
  EXPECT_LT(up[3], 60);
}

TEST(Canvas, TextIsUtf8AndSurvivesAnythingElse) {
  Picture picture = whitePicture(200, 60);
  {
    Canvas canvas(picture);
    EXPECT_GT(canvas.textWidth("µm", 10), canvas.textWidth("m", 10));
    EXPECT_EQ(canvas.textWidth("", 10), 0);
    EXPECT_EQ(canvas.textWidth("\xff", 10), canvas.textWidth("\\xff", 10));
    EXPECT_EQ(canvas.textWidth("\xc2", 10), canvas.textWidth("\\xc2", 10)) << "cut short";
    canvas.text("\xff", {-90, 1e5}, 12, kBlack);
    canvas.text("seen", {10, 40}, 12, kBlack);
  }
  EXPECT_GT(ink(picture), 100);
}

TEST(Canvas, WritesASvgDocument) {
  std::string svg;
  Canvas(120, 50, svg).line({1, 2}, {3, 4.5}, 2, {0, 0, 255});
  EXPECT_EQ(svg.rfind("<?xml", 0), 0u);
  for (const char* part : {"viewBox=\"0 0 120 50\"", "width=\"120px\"", "rgb(0%,0%,100%)", "L 3 4.5"})
    EXPECT_NE(svg.find(part), std::string::npos) << part << '\n' << svg;
  EXPECT_EQ(svg.substr(svg.size() - 7), "</svg>\n");
}

}  // namespace
}  // namespace filiform::tools
