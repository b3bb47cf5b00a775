#include "index/formats/internal/h5_morphology.h"

#include "tests/support/graph_reading.h"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using Structure = std::vector<std::array<std::int64_t, 3>>;

// Points on a line, one um apart, behind two points of a soma at the origin.
std::vector<std::array<double, 4>> line(int count) {
  std::vector<std::array<double, 4>> points{{-1, 0, 0, 2}, {1, 0, 0, 2}};
  for (int i = 0; i < count; ++i) points.push_back({0, 2.0 + i, 0, 1});
  return points;
}

std::string h5Row(const std::vector<std::array<double, 4>>& points, const Structure& structure, Cell* cell = nullptr) {
  test::GraphReading reading;
  reading.report = internal::h5Morphology(points, structure, "made up", {}, reading.cell);
  if (cell != nullptr) *cell = reading.cell;
  return test::readingRow(reading);
}

TEST(H5Morphology, WhatHasAPositionIsKept) {
  const std::string usual = "accept 5 4 0 0 SOMA_CONTOUR:1 SOMA_LINK:1";
  EXPECT_EQ(h5Row(line(4), {{0, 1, -1}, {2, 3, 0}}), usual);
  EXPECT_EQ(h5Row(line(4), {{0, 1, -2}, {2, 3, 0}}), usual) << "the parent of a soma does not matter";
  EXPECT_EQ(h5Row(line(4), {{0, 1, -1}, {2, 3, -1}}), usual);
  EXPECT_EQ(h5Row(line(4), {{0, 1, 0xFFFFFFFF}, {2, 3, 0xFFFFFFFF}}), usual) << "-1 of an unsigned array";
  EXPECT_EQ(h5Row(line(4), {{0, 1, -1}, {2, 3, 0}, {6, 3, 1}}), "warn 5 4 0 0 SOMA_CONTOUR:1 SOMA_LINK:1 W_ELEMENT:1")
      << "a last section without points";
  EXPECT_EQ(h5Row(line(4), {{0, 1, -1}, {2, 3, 0}, {9, 3, 1}}), "warn 5 4 0 0 SOMA_CONTOUR:1 SOMA_LINK:1 W_ELEMENT:1");
  EXPECT_EQ(h5Row(line(4), {{0, 1, -1}, {2, 3, 0}, {1, 3, 1}, {4, 3, 1}}),
            "warn 5 4 0 0 SOMA_CONTOUR:1 SOMA_LINK:1 W_ELEMENT:1")
      << "a section that begins before the one before it takes no points from others";
  EXPECT_EQ(h5Row(line(4), {{0, 1, -1}, {2, 3, 0}, {4, 3, 7}}),
            "warn 5 4 0 1 SOMA_CONTOUR:1 SOMA_LINK:2 W_MISSING_PARENT:1");
  EXPECT_EQ(h5Row(line(4), {{2, 3, 0}}), "warn 4 3 2 0 W_BAD_LINE:2") << "points of no section, and no soma";
  EXPECT_EQ(h5Row(line(4), {{0, 1, -1}, {-3, 3, 0}, {2, 3, 0}}), "warn 5 4 0 0 SOMA_CONTOUR:1 SOMA_LINK:1 W_ELEMENT:1")
      << "a section that begins before the first point has none";
}

TEST(H5Morphology, WhatFollowsAnEmptySectionContinuesItsParent) {
  Cell cell;
  EXPECT_EQ(h5Row(line(4), {{0, 1, -1}, {2, 3, 0}, {4, 3, 1}, {4, 3, 2}}, &cell),
            "warn 5 4 0 0 SOMA_CONTOUR:1 SOMA_LINK:1 W_ELEMENT:1");
  EXPECT_EQ(cell.parents, (std::vector<std::uint32_t>{kNoParent, 0, 1, 2, 3}));
}

TEST(H5Morphology, ASectionThatBeginsOnAnotherTreeIsJoinedThere) {
  auto points = line(4);
  points.push_back({0, 4, 0, 1});
  points.push_back({9, 4, 0, 1});
  EXPECT_EQ(h5Row(points, {{0, 1, -1}, {2, 3, 0}, {6, 2, 0}}),
            "accept 6 5 0 0 REPEATED_POINT:1 SOMA_CONTOUR:1 SOMA_LINK:1");
}

}  // namespace
}  // namespace filiform
