#include "tools/lab/evaluate/trials/travel_meter.h"

#include "tests/lab/evaluation_cells.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <set>
#include <utility>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

// 0 --- 1 --- 2 --- 3 along x, 10 um apart. 4 and 5 branch off 1 along y.
Cell comb() {
  return test::cellOf({{0, 0, 0}, {10, 0, 0}, {20, 0, 0}, {30, 0, 0}, {10, 10, 0}, {10, 20, 0}},
                      {kNoParent, 0, 1, 2, 1, 4});
}
Route alongX(const TrialCell& cell) {
  const CellGraph& graph = cell.graph();
  return Route(0, graph.grid, graph.positions, graph.parents, 0, 3);
}

TEST(TravelMeter, ArcAlongTheRouteIsNeitherOffNorSkipped) {
  TrialCell cell(comb());
  const Route route = alongX(cell);
  TravelMeter meter(cell, route, 2500);
  for (double t = 1; t >= 0; t -= 0.125) meter.update(cell.placeAt(1, t));
  for (double t = 1; t >= 0; t -= 0.125) meter.update(cell.placeAt(2, t));
  EXPECT_DOUBLE_EQ(meter.off_um(), 0);
  EXPECT_DOUBLE_EQ(meter.skip_um(), 0);
}

TEST(TravelMeter, ASideBranchCountsOutAndBack) {
  TrialCell cell(comb());
  const Route route = alongX(cell);
  TravelMeter meter(cell, route, 2500);
  meter.update(cell.placeAt(1, 0.5));  // x = 5
  meter.update(cell.placeAt(5, 0.5));  // 5 um to the branch, 15 um up it
  EXPECT_DOUBLE_EQ(meter.off_um(), 15);
  meter.update(cell.placeAt(2, 0.5));  // 15 um back, 5 um on
  EXPECT_DOUBLE_EQ(meter.off_um(), 30);
}

TEST(TravelMeter, ALeapIsLongAndFarFromItsChord) {
  // A hairpin: 40 um out, 1 um across, 40 um back.
  TrialCell cell(test::cellOf({{0, 0, 0}, {40, 0, 0}, {40, 1, 0}, {0, 1, 0}}, {kNoParent, 0, 1, 2}));
  const CellGraph& graph = cell.graph();
  const Route route(0, graph.grid, graph.positions, graph.parents, 0, 3);
  TravelMeter leap(cell, route, 2500), straight(cell, route, 2500), small(cell, route, 1e6);
  leap.update(cell.placeAt(1, 0.75));  // x = 10
  leap.update(cell.placeAt(3, 0.25));  // x = 10 on the other leg
  EXPECT_DOUBLE_EQ(leap.skip_um(), 61);
  EXPECT_DOUBLE_EQ(leap.off_um(), 0);
  straight.update(cell.placeAt(1, 0.75));
  straight.update(cell.placeAt(1, 0.25));  // 20 um along its own chord
  EXPECT_DOUBLE_EQ(straight.skip_um(), 0);
  small.update(cell.placeAt(1, 0.75));
  small.update(cell.placeAt(3, 0.25));  // less than 1 mm of the device at this scale
  EXPECT_DOUBLE_EQ(small.skip_um(), 0);
}

// By the definition, from the two ends of each segment.
double arcBetween(const TrialCell& cell, const ProxyPlace& a, const ProxyPlace& b) {
  const CellGraph& graph = cell.graph();
  const auto nodes = [&](std::uint32_t from, std::uint32_t to) {
    std::set<std::uint32_t> above;
    for (std::uint32_t at = from; at != kNoParent; at = graph.parents[at]) above.insert(at);
    while (above.count(to) == 0) to = graph.parents[to];
    return to;
  };
  const auto length = [&](std::uint32_t child) {
    return (graph.position_W(child) - graph.position_W(graph.parents[child])).norm();
  };
  const std::uint32_t i = a.segment.segment, j = b.segment.segment;
  if (i == j) return std::abs(a.t - b.t) * length(i);
  double least = std::numeric_limits<double>::infinity();
  for (const auto& [from, a_um] : {std::pair{i, a.t * length(i)}, {graph.parents[i], (1 - a.t) * length(i)}})
    for (const auto& [to, b_um] : {std::pair{j, b.t * length(j)}, {graph.parents[j], (1 - b.t) * length(j)}})
      least =
          std::min(least, a_um + b_um + cell.depth_um(from) + cell.depth_um(to) - 2 * cell.depth_um(nodes(from, to)));
  return least;
}

TEST(TravelMeter, ArcOffTheRouteIsThatOfTheTree) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    TrialCell cell(test::randomTree(seed, 60));
    const CellGraph& graph = cell.graph();
    auto tip = static_cast<std::uint32_t>(graph.samples() - 1);
    while (cell.depth_um(tip) == 0) --tip;
    const Route route(0, graph.grid, graph.positions, graph.parents, 0, tip);
    std::mt19937_64 random(seed);
    const auto place = [&] {
      const auto child = 1 + static_cast<std::uint32_t>(random() % (graph.samples() - 1));
      return cell.placeAt(child, static_cast<double>(random() % 5) / 4);
    };
    for (int i = 0; i < 200; ++i) {
      const ProxyPlace a = place(), b = place();
      const double along = std::abs(route.progress(a).arc_um - route.progress(b).arc_um);
      TravelMeter meter(cell, route, 2500);
      meter.update(a);
      meter.update(b);
      EXPECT_NEAR(meter.off_um(), std::max(0.0, arcBetween(cell, a, b) - along), 1e-9);
    }
  }
}

}  // namespace
}  // namespace filiform::tools
