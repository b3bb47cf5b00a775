#include "tools/serve/desk/desk_place.h"

#include <cmath>
#include <limits>
#include <string>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

DeskPlace somePlace() {
  return {.proxy_W = {1.5, -2e5, 0.1},
          .hand_W = {1, 2, 3},
          .centre_W = {-4, 5, 6},
          .rotation_WD = {0.5, -0.5, 0.5, 0.5},
          .zoom_um = 250,
          .force_N = 1.25,
          .constrained = false};
}

TEST(DeskPlace, ComesBackFromItsText) {
  const DeskPlace place = somePlace();
  const auto back = parseDeskPlace(toJson(place));
  ASSERT_TRUE(back);
  EXPECT_EQ(back->proxy_W, place.proxy_W);
  EXPECT_EQ(back->hand_W, place.hand_W);
  EXPECT_EQ(back->centre_W, place.centre_W);
  EXPECT_EQ(back->rotation_WD, place.rotation_WD);
  EXPECT_EQ(back->zoom_um, 250);
  EXPECT_EQ(back->force_N, 1.25);
  EXPECT_FALSE(back->constrained);
  EXPECT_LE(toJson(place).size(), DeskPlace::kMostBytes);
}

TEST(DeskPlace, LongestNumbersFit) {
  DeskPlace place = somePlace();
  place.proxy_W = place.hand_W = place.centre_W = {-123456789012.34567, -1.2345678901234567e-300, 1e12};
  EXPECT_LE(toJson(place).size(), DeskPlace::kMostBytes);
  EXPECT_TRUE(parseDeskPlace(toJson(place)));
}

TEST(DeskPlace, WrongTextsAreNoPlace) {
  const std::string good = toJson(somePlace());
  ASSERT_TRUE(parseDeskPlace(good));
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    text.replace(text.find(from), from.size(), to);
    return text;
  };
  for (const std::string& text : {std::string(),
                                  std::string("{"),
                                  std::string("[]"),
                                  std::string("null"),
                                  std::string("{}"),
                                  with("\"zoom_um\":250.0", "\"zoom_um\":0"),
                                  with("\"zoom_um\":250.0", "\"zoom_um\":\"250\""),
                                  with("\"zoom_um\":250.0", "\"zoom_um\":1e300"),
                                  with("\"force_N\":1.25", "\"force_N\":-1"),
                                  with("\"force_N\":1.25", "\"force_N\":null"),
                                  with("[1.0,2.0,3.0]", "[1.0,2.0]"),
                                  with("[1.0,2.0,3.0]", "[1.0,2.0,null]"),
                                  with("[1.0,2.0,3.0]", "[1.0,2.0,1e300]"),
                                  with("[1.0,2.0,3.0]", "[1.0,2.0,1e999]"),
                                  with("[0.5,", "[5.0,"),
                                  with("false", "0"),
                                  with("\"force_N\"", "\"force\""),
                                  with("{", "{\"more\":1,"),
                                  good + "x",
                                  std::string(2000, '[')})
    EXPECT_FALSE(parseDeskPlace(text)) << text;
}

TEST(DeskPlace, NumbersThatAreNotFiniteAreNoPlace) {
  for (const double wrong : {std::nan(""), std::numeric_limits<double>::infinity()}) {
    DeskPlace place = somePlace();
    place.hand_W[1] = wrong;
    EXPECT_FALSE(parseDeskPlace(toJson(place)));
  }
}

}  // namespace
}  // namespace filiform::tools
