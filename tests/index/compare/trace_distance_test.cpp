#include "index/compare/trace_distance.h"

#include "index/geometry/closest_point.h"
#include "tests/support/scenes/memory_store.h"
#include "tests/support/scenes/random_cells.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>
#include <utility>

#include <gtest/gtest.h>

namespace filiform {
namespace {

CellGraph traceOf(const Cell& cell) { return readCell(*test::storeOf({cell}), 0, true); }

CellGraph polyline(std::vector<Vector3d> points) {
  Cell cell;
  for (std::size_t i = 0; i < points.size(); ++i)
    test::addSample(cell, points[i], i == 0 ? kNoParent : static_cast<std::uint32_t>(i - 1));
  return traceOf(cell);
}

double bruteDistance(const CellGraph& to, const Vector3d& p_W) {
  double best2 = HUGE_VAL;
  for (std::uint32_t i = 0; i < to.samples(); ++i) {
    const std::uint32_t parent = to.parents[i] == kNoParent ? i : to.parents[i];
    best2 = std::min(best2, closestPoint(to.position_W(i), to.position_W(parent), p_W).squared_distance);
  }
  return std::sqrt(best2);
}

TEST(TraceDistance, OfAParallelLineIsThatOfTheLines) {
  const CellGraph a = polyline({{0, 0, 0}, {30, 0, 0}, {100, 0, 0}}), b = polyline({{0, 3, 0}, {100, 3, 0}});
  for (const double within_um : {1.0, 2.9, 3.1, 50.0}) {
    const TraceDistance d = traceDistance(a, b, {.within_um = within_um});
    EXPECT_DOUBLE_EQ(d.length_um, 100);
    EXPECT_DOUBLE_EQ(d.within_length_um, within_um > 3 ? 100 : 0);
    EXPECT_NEAR(d.mean_um, 3, 1e-12);
    EXPECT_NEAR(d.median_um, 3, 1e-12);
    EXPECT_NEAR(d.max_um, 3, 1e-12);
    EXPECT_DOUBLE_EQ(d.step_um, within_um / 20);
  }
}

TEST(TraceDistance, SplitsSegmentsWhereTheyEnterAndLeave) {
  // A cross: within 2 um of the other line, 4 um; within 2 um of its end, a ball cuts the line.
  const CellGraph x = polyline({{-50, 0, 0}, {50, 0, 0}}), y = polyline({{0, -50, 0}, {0, 50, 0}});
  EXPECT_NEAR(traceDistance(x, y).within_length_um, 4, 1e-12);
  const CellGraph end = polyline({{0, 1, 0}, {0, 50, 0}});
  EXPECT_NEAR(traceDistance(x, end).within_length_um, 2 * std::sqrt(3.0), 1e-12);
  EXPECT_NEAR(traceDistance(end, x).within_length_um, 1, 1e-12);
  EXPECT_NEAR(traceDistance(x, polyline({{0, 1, 0}})).within_length_um, 2 * std::sqrt(3.0), 1e-12) << "one sample";
  // A piece that several segments cover counts once.
  const CellGraph twice = polyline({{0, 0, 0}, {10, 0, 0}, {0, 0, 0}});
  EXPECT_NEAR(traceDistance(x, twice).within_length_um, 14, 1e-12);
}

TEST(TraceDistance, HasADirection) {
  const CellGraph whole = polyline({{0, 0, 0}, {100, 0, 0}}), part = polyline({{0, 0, 0}, {40, 0, 0}});
  EXPECT_DOUBLE_EQ(traceDistance(part, whole).within_length_um, 40);
  EXPECT_NEAR(traceDistance(part, whole).max_um, 0, 1e-12);
  EXPECT_NEAR(traceDistance(whole, part).within_length_um, 42, 1e-12);
  EXPECT_DOUBLE_EQ(traceDistance(whole, part).max_um, 60) << "at a sample, so it is exact";
  EXPECT_NEAR(traceDistance(whole, part).mean_um, 60.0 * 30 / 100, 0.05);
  EXPECT_NEAR(traceDistance(whole, part).median_um, 10, 0.05);
}

TEST(TraceDistance, IsThatOfDensePoints) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    SCOPED_TRACE(seed);
    const Cell first = test::randomNeuron(seed, {.samples = 80});
    Cell second = seed % 2 == 0 ? first : test::randomNeuron(seed + 100, {.samples = 60});
    std::mt19937_64 random(seed);
    std::normal_distribution<double> shift(0, 1.5);
    for (Vector3d& p : second.positions_um) p += Vector3d(shift(random), shift(random), shift(random));
    const CellGraph a = traceOf(first), b = traceOf(second);
    const TraceDistance d = traceDistance(a, b, {.within_um = 2});
    double length = 0, within = 0, sum = 0, max = 0;
    std::vector<std::pair<double, double>> places;
    constexpr int kPieces = 200;
    for (const auto& [parent, child] : parentLinks(a)) {
      const Vector3d p = a.position_W(child), q = a.position_W(parent);
      const double piece = (q - p).norm() / kPieces;
      for (int i = 0; i < kPieces; ++i) {
        const double distance = bruteDistance(b, p + (i + 0.5) / kPieces * (q - p));
        length += piece;
        within += distance <= 2 ? piece : 0;
        sum += distance * piece;
        max = std::max(max, distance);
        places.push_back({distance, piece});
      }
    }
    std::sort(places.begin(), places.end());
    double median = 0, half = 0;
    for (const auto& [distance, piece] : places)
      if ((half += piece) >= length / 2) {
        median = distance;
        break;
      }
    EXPECT_NEAR(d.length_um, length, 1e-9 * length);
    if (seed % 2 == 0) {
      EXPECT_GT(within, length / 10);
    }
    // Each border of the length within is found to a piece.
    EXPECT_NEAR(d.within_length_um, within, 2e-3 * length);
    EXPECT_NEAR(d.mean_um, sum / length, d.step_um / 2);
    EXPECT_NEAR(d.median_um, median, d.step_um / 2 + 0.01);
    EXPECT_NEAR(d.max_um, max, d.step_um / 2 + 0.01);
  }
}

TEST(TraceDistance, OfCoarserStepsStaysWithinHalfAStep) {
  const CellGraph a = traceOf(test::randomNeuron(8, {.samples = 300})),
                  b = traceOf(test::randomNeuron(9, {.samples = 300}));
  const TraceDistance fine = traceDistance(a, b, {.within_um = 1});
  for (const std::uint64_t places : {1, 50, 1000}) {
    const TraceDistance coarse = traceDistance(a, b, {.within_um = 1, .most_places = places});
    EXPECT_DOUBLE_EQ(coarse.step_um, std::max(1 / 20., fine.length_um / static_cast<double>(places)));
    EXPECT_EQ(coarse.within_length_um, fine.within_length_um);
    const double off = (coarse.step_um + fine.step_um) / 2;
    EXPECT_NEAR(coarse.mean_um, fine.mean_um, off);
    EXPECT_NEAR(coarse.median_um, fine.median_um, off);
    EXPECT_NEAR(coarse.max_um, fine.max_um, off);
  }
}

TEST(TraceDistance, WithoutALengthIsNone) {
  const TraceDistance d = traceDistance(polyline({{1, 2, 3}}), polyline({{0, 0, 0}, {9, 0, 0}}));
  EXPECT_EQ(d.length_um, 0);
  EXPECT_EQ(d.within_length_um, 0);
  EXPECT_TRUE(std::isnan(d.mean_um) && std::isnan(d.median_um) && std::isnan(d.max_um));
  // Segments without length between others.
  EXPECT_NEAR(traceDistance(traceOf(test::coincidentNodes(50)), polyline({{0, 0, 0}})).length_um, 0, 1e-12);
}

TEST(TraceDistance, CanBeEnded) {
  const CellGraph a = traceOf(test::randomNeuron(8));
  EXPECT_THROW(traceDistance(a, a, {.check = [] { throw std::runtime_error("ended"); }}), std::runtime_error);
}

}  // namespace
}  // namespace filiform
