// Routes end on neurites, not on the samples that give a soma its shape.
#include "index/errors.h"
#include "index/query/cell_graph.h"
#include "solver/travel/routes/route.h"
#include "tests/support/scenes/memory_store.h"
#include "tests/support/scenes/random_cells.h"

#include <set>

#include <gtest/gtest.h>

namespace filiform {
namespace {

// A three-point soma whose outer samples are farther from the root than the tips of its two neurites.
Cell stubby() {
  Cell cell;
  test::addSample(cell, {0, 0, 0}, kNoParent, 10, 1);
  test::addSample(cell, {0, -10, 0}, 0, 10, 1);
  test::addSample(cell, {0, 10, 0}, 0, 10, 1);
  test::addSample(cell, {4, 0, 0}, 0, 1, 3);
  test::addSample(cell, {8, 0, 0}, 3, 1, 3);
  test::addSample(cell, {-6, 0, 0}, 0, 1, 3);
  return cell;
}

TEST(SomaRoutes, NeitherTheLongestNorARandomOneEndsInTheSoma) {
  const auto store = test::storeOf({stubby()}, 2);
  const CellGraph graph = readCell(*store, 0, false);
  EXPECT_EQ(planRoute(graph, 0, {}).points().back().rank, 4U);
  EXPECT_EQ(planRoute(graph, 0, {}).length_um(), 8);
  std::set<std::uint32_t> ends;
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    const std::optional<Route> route = planRandomRoute(graph, 0, seed);
    ASSERT_TRUE(route);
    EXPECT_EQ(route->points().front().rank, 0U);
    ends.insert(route->points().back().rank);
  }
  EXPECT_EQ(ends, (std::set<std::uint32_t>{4, 5}));
}

TEST(SomaRoutes, ARouteBetweenSamplesGoesWhereItIsAsked) {
  const auto store = test::storeOf({stubby()}, 2);
  const CellGraph graph = readCell(*store, 0, false);
  const std::string ids = std::to_string(graph.sample_ids[1]) + ":" + std::to_string(graph.sample_ids[4]);
  EXPECT_EQ(planRoute(graph, 0, routeChoiceOf(ids)).length_um(), 18);
}

TEST(SomaRoutes, ASomaAloneHasNoRoute) {
  Cell cell = stubby();
  for (int i = 0; i < 3; ++i) {
    cell.sample_ids.pop_back();
    cell.positions_um.pop_back();
    cell.parents.pop_back();
    cell.radii_um.pop_back();
    cell.types.pop_back();
  }
  const auto store = test::storeOf({cell}, 2);
  const CellGraph graph = readCell(*store, 0, false);
  EXPECT_THROW(planRoute(graph, 0, {}), UsageError);
  EXPECT_FALSE(planRandomRoute(graph, 0, 1));
}

}  // namespace
}  // namespace filiform
