#include "solver/travel/routes/route.h"

#include "index/cell/cell.h"
#include "index/errors.h"
#include "index/query/cell_graph.h"
#include "tests/support/scenes/random_cells.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <random>
#include <string>

#include <gtest/gtest.h>

namespace filiform {
namespace {

const Grid kGrid;
constexpr std::uint32_t kCell = 4;

CellGraph graphOf(const Cell& cell) {
  CellGraph graph;
  graph.sample_ids = cell.sample_ids;
  graph.parents = cell.parents;
  for (const Vector3d& p_um : cell.positions_um) graph.positions.push_back(kGrid.snap(p_um));
  return graph;
}

// 1-2-3-4, a twig 5 at 3, a separate tree 6-7, and an isolated sample 8.
CellGraph fork() {
  CellGraph graph;
  graph.sample_ids = {1, 2, 3, 4, 5, 6, 7, 8};
  graph.parents = {kNoParent, 0, 1, 2, 2, kNoParent, 5, kNoParent};
  const Vector3d points[] = {{0, 0, 0}, {2, 0, 0}, {4, 0, 0}, {4, 3, 0}, {9, 0, 0}, {50, 0, 0}, {50, 1, 0}, {80, 0, 0}};
  for (const Vector3d& p : points) graph.positions.push_back(kGrid.snap(p));
  return graph;
}

std::vector<std::uint32_t> ranks(const Route& route) {
  std::vector<std::uint32_t> found;
  for (const Route::Point& point : route.points()) found.push_back(point.rank);
  return found;
}

using RankList = std::vector<std::uint32_t>;

ProxyPlace onSegment(std::uint32_t rank, double t) {
  ProxyPlace place;
  place.segment = {4, rank};
  place.t = t;
  place.tile = 0;
  return place;
}

ProxyPlace atNode(std::uint32_t rank) {
  ProxyPlace place = onSegment(rank, 0);
  place.at_node = true;
  place.node = {4, rank};
  return place;
}

TEST(PlanRoute, JoinsTwoSamplesByTheirIds) {
  EXPECT_EQ(ranks(planRoute(fork(), kCell, routeChoiceOf("1:4"))), (RankList{0, 1, 2, 3}));
  EXPECT_EQ(ranks(planRoute(fork(), kCell, routeChoiceOf("4:1"))), (RankList{3, 2, 1, 0}));
  EXPECT_EQ(ranks(planRoute(fork(), kCell, routeChoiceOf("4:5"))), (RankList{3, 2, 4}));
  EXPECT_DOUBLE_EQ(planRoute(fork(), kCell, routeChoiceOf("4:5")).length_um(), 8);
}

TEST(PlanRoute, LongestIsByArcLength) { EXPECT_EQ(ranks(planRoute(fork(), kCell, {})), (RankList{0, 1, 2, 4})); }

TEST(PlanRoute, LongestTakesTheLowestRanksOfEquals) {
  CellGraph graph;
  graph.sample_ids = {1, 2, 3, 4, 5};
  graph.parents = {2, 2, kNoParent, kNoParent, 3};  // children before their parent
  const Vector3d points[] = {{3, 4, 0}, {0, 5, 0}, {0, 0, 0}, {9, 0, 0}, {9, 0, 5}};
  for (const Vector3d& p : points) graph.positions.push_back(kGrid.snap(p));
  EXPECT_EQ(ranks(planRoute(graph, kCell, {})), (RankList{2, 0}));
}

TEST(PlanRoute, RepeatedIdsMeanTheJoinedPairOfLowestRanks) {
  CellGraph graph = fork();
  graph.sample_ids = {1, 2, 3, 4, 5, 1, 2, 8};
  EXPECT_EQ(ranks(planRoute(graph, kCell, routeChoiceOf("1:2"))), (RankList{0, 1}));
  graph.sample_ids = {10, 20, 3, 4, 5, 1, 2, 1};
  EXPECT_EQ(ranks(planRoute(graph, kCell, routeChoiceOf("1:2"))), (RankList{5, 6}));
}

TEST(PlanRoute, RefusesUnknownRoutes) {
  for (const char* spec : {"99:4", "1:99", "1:7", "1:8", "1:1", "8:8", "tour:1"})
    EXPECT_THROW(planRoute(fork(), kCell, routeChoiceOf(spec)), UsageError) << spec;
}

TEST(PlanRoute, RefusesACellWithoutLength) {
  CellGraph graph;
  for (const char* spec : {"longest", "random:1"})
    EXPECT_THROW(planRoute(graph, kCell, routeChoiceOf(spec)), UsageError);
  graph.sample_ids = {1, 2, 3};
  graph.parents = {kNoParent, 0, kNoParent};
  graph.positions.assign(3, GridPoint::Constant(7));
  for (const char* spec : {"longest", "random:1", "1:2"})
    EXPECT_THROW(planRoute(graph, kCell, routeChoiceOf(spec)), UsageError);
}

TEST(PlanRoute, RandomGoesFromARootToATipOfItsTree) {
  const CellGraph graph = graphOf(test::randomNeuron(5, {.samples = 400, .extra_root = 0.02, .shuffled_files = true}));
  std::vector<int> children(graph.parents.size(), 0);
  for (const std::uint32_t parent : graph.parents)
    if (parent != kNoParent) ++children[parent];
  std::vector<RankList> seen;
  for (int seed = 0; seed < 50; ++seed) {
    const Route route = planRoute(graph, kCell, routeChoiceOf("random:" + std::to_string(seed)));
    EXPECT_EQ(graph.parents[route.points().front().rank], kNoParent);
    EXPECT_EQ(children[route.points().back().rank], 0);
    EXPECT_EQ(ranks(route), ranks(planRoute(graph, kCell, routeChoiceOf("random:" + std::to_string(seed)))));
    seen.push_back(ranks(route));
  }
  std::sort(seen.begin(), seen.end());
  EXPECT_GT(std::unique(seen.begin(), seen.end()) - seen.begin(), 5);
}

TEST(PlanRoute, LongestAgreesWithTryingEveryTip) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE(seed);
    const CellGraph graph =
        graphOf(test::randomNeuron(seed, {.samples = 300, .extra_root = 0.02, .shuffled_files = seed % 2 == 0}));
    double best_um = 0;
    for (std::uint32_t rank = 0; rank < graph.parents.size(); ++rank) {
      double length_um = 0;
      for (std::uint32_t at = rank; graph.parents[at] != kNoParent; at = graph.parents[at])
        length_um += (kGrid.toWorld(graph.positions[at]) - kGrid.toWorld(graph.positions[graph.parents[at]])).norm();
      best_um = std::max(best_um, length_um);
    }
    EXPECT_NEAR(planRoute(graph, kCell, {}).length_um(), best_um, 1e-9 * best_um);
  }
}

TEST(Route, StartsOnItsFirstSegment) {
  const Route down = planRoute(fork(), kCell, routeChoiceOf("1:4")),
              up = planRoute(fork(), kCell, routeChoiceOf("4:1"));
  EXPECT_EQ(down.first_segment(), (SegmentId{4, 1}));
  EXPECT_EQ(down.first_t(), 1);
  EXPECT_EQ(up.first_segment(), (SegmentId{4, 3}));
  EXPECT_EQ(up.first_t(), 0);
}

TEST(Route, PointsLieAtTheirArcLengthAndStraightOnPastTheTip) {
  const Route route = planRoute(fork(), kCell, routeChoiceOf("1:4"));
  EXPECT_EQ(route.pointAt(-1), Vector3d(0, 0, 0));
  EXPECT_EQ(route.pointAt(std::numeric_limits<double>::quiet_NaN()), Vector3d(0, 0, 0));
  EXPECT_EQ(route.pointAt(3), Vector3d(3, 0, 0));
  EXPECT_EQ(route.pointAt(5), Vector3d(4, 1, 0));
  EXPECT_EQ(route.pointAt(7), Vector3d(4, 3, 0));
  EXPECT_EQ(route.pointAt(8.5), Vector3d(4, 4.5, 0));
}

TEST(Route, ProgressIsTheArcOrWhereTheStructureLeadsBack) {
  const Route route = planRoute(fork(), kCell, routeChoiceOf("1:4"));
  EXPECT_DOUBLE_EQ(route.progress(atNode(2)).arc_um, 4);
  EXPECT_TRUE(route.progress(atNode(2)).on_route);
  EXPECT_DOUBLE_EQ(route.progress(onSegment(3, 0.25)).arc_um, 6.25);
  EXPECT_TRUE(route.progress(onSegment(3, 0.25)).on_route);
  for (const ProxyPlace& twig : {onSegment(4, 0.5), atNode(4)}) {
    EXPECT_DOUBLE_EQ(route.progress(twig).arc_um, 4);
    EXPECT_FALSE(route.progress(twig).on_route);
    EXPECT_TRUE(route.progress(twig).connected);
  }
  for (const ProxyPlace& elsewhere : {onSegment(6, 0.5), atNode(7), onSegment(7, 0), onSegment(99, 0), ProxyPlace{}})
    EXPECT_FALSE(route.progress(elsewhere).connected);
  ProxyPlace other_cell = onSegment(3, 0.5);
  other_cell.segment.cell = 5;
  EXPECT_FALSE(route.progress(other_cell).connected);
}

TEST(Route, ProgressAgreesWithWalkingTheTree) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(seed);
    const CellGraph graph = graphOf(
        test::randomNeuron(seed, {.samples = 300, .branching = 0.08, .extra_root = 0.01, .shuffled_files = true}));
    const auto samples = static_cast<std::uint32_t>(graph.parents.size());
    std::mt19937_64 random(seed);
    std::uint32_t first = 0, last = 0;
    const auto rootOf = [&](std::uint32_t at) {
      while (graph.parents[at] != kNoParent) at = graph.parents[at];
      return at;
    };
    while (first == last || rootOf(first) != rootOf(last)) {
      first = static_cast<std::uint32_t>(random() % samples);
      last = static_cast<std::uint32_t>(random() % samples);
    }
    const Route route(4, kGrid, graph.positions, graph.parents, first, last);
    ASSERT_EQ(route.points().front().rank, first);
    ASSERT_EQ(route.points().back().rank, last);
    // Spreads from all points of the route at once: each sample learns the point from which its branch leaves the
    // route.
    std::vector<double> arc_um(samples, -1);
    std::vector<std::vector<std::uint32_t>> neighbours(samples);
    for (std::uint32_t rank = 0; rank < samples; ++rank) {
      if (graph.parents[rank] == kNoParent) continue;
      neighbours[rank].push_back(graph.parents[rank]);
      neighbours[graph.parents[rank]].push_back(rank);
    }
    std::queue<std::uint32_t> queue;
    for (const Route::Point& point : route.points()) {
      arc_um[point.rank] = point.arc_um;
      queue.push(point.rank);
    }
    for (; !queue.empty(); queue.pop())
      for (const std::uint32_t next : neighbours[queue.front()])
        if (arc_um[next] < 0) {
          arc_um[next] = arc_um[queue.front()];
          queue.push(next);
        }
    for (std::uint32_t rank = 0; rank < samples; ++rank) {
      const Route::Progress progress = route.progress(atNode(rank));
      ASSERT_EQ(progress.connected, arc_um[rank] >= 0);
      if (progress.connected) {
        ASSERT_EQ(progress.arc_um, arc_um[rank]);
      }
    }
  }
}

TEST(RouteTracker, KeepsTheFurthestArcOnTheRoute) {
  const Route route = planRoute(fork(), kCell, routeChoiceOf("1:4"));
  RouteTracker tracker(route);
  tracker.update(onSegment(1, 0.5));
  EXPECT_DOUBLE_EQ(tracker.reached_um(), 1);
  tracker.update(onSegment(4, 0.5));  // off the route
  tracker.update(atNode(0));          // back at its start
  EXPECT_DOUBLE_EQ(tracker.reached_um(), 1);
  tracker.update(atNode(3));
  EXPECT_DOUBLE_EQ(tracker.reached_um(), 7);
}

}  // namespace
}  // namespace filiform
