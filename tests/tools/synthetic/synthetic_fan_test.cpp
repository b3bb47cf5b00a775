#include "tools/synthetic/synthetic_fan.h"

#include "index/errors.h"
#include "index/input/input.h"
#include "tests/support/temp_folder.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

std::vector<std::uint32_t> childrenOf(const Cell& cell, std::uint32_t parent) {
  std::vector<std::uint32_t> children;
  for (std::uint32_t i = 0; i < cell.samples(); ++i)
    if (cell.parents[i] == parent) children.push_back(i);
  return children;
}

double angle_rad(const Vector3d& a, const Vector3d& b) { return std::atan2(a.cross(b).norm(), a.dot(b)); }

// The corners on the way from the root to this tip: turns of more than 1 rad.
std::vector<double> turns(const Fan& fan, std::uint32_t tip) {
  std::vector<Vector3d> route;
  for (std::uint32_t i = tip; i != kNoParent; i = fan.cell.parents[i]) route.push_back(fan.cell.positions_um[i]);
  std::vector<double> out;
  for (std::size_t i = 1; i + 1 < route.size(); ++i) {
    const double turn = angle_rad(route[i] - route[i - 1], route[i + 1] - route[i]);
    if (turn > 1) out.push_back(turn);
  }
  return out;
}

TEST(SyntheticFan, TheWantedBranchIsInTheMiddleAndTwoSharpElbowsFollow) {
  for (const int branches : {2, 3, 5, 7, 10}) {
    for (std::uint64_t number = 0; number < 20; ++number) {
      const FanOptions options = drawFan(3, number, branches);
      SCOPED_TRACE(testing::Message() << branches << " branches, cone " << options.cone_rad << " rad, segments "
                                      << options.segment_um << " um, seed " << options.seed);
      EXPECT_GE(options.cone_rad, 0.05);
      EXPECT_LE(options.cone_rad, 0.6);
      EXPECT_GE(options.segment_um, 2);
      EXPECT_LE(options.segment_um, 30);
      const Fan fan = buildFan(options);
      EXPECT_NE(fan.cell.source.find("fan"), std::string::npos);
      EXPECT_EQ(fan.first, 0U);
      EXPECT_TRUE(childrenOf(fan.cell, fan.last).empty());

      std::uint32_t on_route = fan.last, node = fan.cell.parents[fan.last];
      while (childrenOf(fan.cell, node).size() == 1) on_route = node, node = fan.cell.parents[node];
      const std::vector<std::uint32_t> first = childrenOf(fan.cell, node);
      ASSERT_EQ(first.size(), static_cast<std::size_t>(branches));
      const Vector3d stem = fan.cell.positions_um[node] - fan.cell.positions_um[0];
      EXPECT_NEAR(stem.norm(), 60, 0.01);
      const auto direction = [&](std::uint32_t i) -> Vector3d {
        return fan.cell.positions_um[i] - fan.cell.positions_um[node];
      };
      EXPECT_LT(angle_rad(stem, direction(on_route)), 0.002);
      for (const std::uint32_t i : first) {
        if (i == on_route) continue;
        EXPECT_NEAR(angle_rad(direction(on_route), direction(i)), options.cone_rad, 0.002);
      }

      EXPECT_EQ(options.alike, number % 2 == 1);
      for (std::uint32_t tip = 1; tip < fan.cell.samples(); ++tip) {
        if (!childrenOf(fan.cell, tip).empty()) continue;
        const std::vector<double> elbows = turns(fan, tip);
        ASSERT_EQ(elbows.size(), tip == fan.last || options.alike ? 2U : 0U);
        for (const double elbow : elbows) {
          EXPECT_GT(elbow, 1.69);
          EXPECT_LT(elbow, 2.21);
        }
      }
    }
  }
}

TEST(SyntheticFan, SegmentsHaveAboutTheLengthAskedFor) {
  for (const double wanted_um : {2.0, 7.0, 30.0}) {
    FanOptions options;
    options.segment_um = wanted_um;
    const Fan fan = buildFan(options);
    for (std::size_t i = 1; i < fan.cell.samples(); ++i) {
      const double length_um = (fan.cell.positions_um[i] - fan.cell.positions_um[fan.cell.parents[i]]).norm();
      EXPECT_GT(length_um, wanted_um / 1.5);
      EXPECT_LT(length_um, wanted_um * 1.67);
    }
  }
}

TEST(SyntheticFan, TheCellIsWhatAReaderOfTheTextGets) {
  const test::TempFolder folder;
  const Fan fan = buildFan(drawFan(1, 7, 5));
  test::writeBytes(folder / "fan.swc", fan.text);
  Input input({folder / "fan.swc"});
  Cell read;
  ASSERT_TRUE(input.next(read));
  EXPECT_EQ(read.digest, fan.cell.digest);
  EXPECT_EQ(read.positions_um, fan.cell.positions_um);
  EXPECT_EQ(read.parents, fan.cell.parents);
  EXPECT_NE(buildFan(drawFan(1, 8, 5)).text, fan.text);
}

TEST(SyntheticFan, RefusesOptionsOutsideTheirRanges) {
  const auto refuses = [](int branches, double cone_rad, double segment_um) {
    EXPECT_THROW(buildFan({branches, cone_rad, segment_um}), UsageError)
        << branches << ", " << cone_rad << ", " << segment_um;
  };
  refuses(1, 0.2, 10);
  refuses(7, -0.1, 10);
  refuses(7, 2, 10);
  refuses(7, std::nan(""), 10);
  refuses(7, 0.2, 0);
  refuses(7, 0.2, std::nan(""));
}

}  // namespace
}  // namespace filiform::tools
