#include "solver/travel/places/junction.h"

#include "tests/support/scenes/test_graph.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace filiform {
namespace {

// A neurite along x with segments of 1 um, and a side branch at every tenth node, from x = 0 to 40.
struct Comb {
  test::TestGraphBuilder build;
  std::vector<std::uint32_t> spine;
  Comb() {
    for (int x = 0; x <= 40; ++x) {
      spine.push_back(build.node({static_cast<double>(x), 0, 0}));
      if (x > 0) build.link(spine.back(), spine[spine.size() - 2]);
      if (x % 10 == 0 && x > 0 && x < 40) {
        const auto a = build.node({static_cast<double>(x), 2, 0}), b = build.node({static_cast<double>(x), 4, 0});
        build.link(a, spine.back());
        build.link(b, a);
      }
    }
  }
};

ProxyPlace placeOn(const test::TiledGraph& tiles, SegmentId segment, double t) {
  return GraphView(tiles.table(), tiles.leaves(), Grid()).placeAt(tiles.tileOf(segment), segment, t);
}

class Junctions : public ::testing::TestWithParam<int> {
 protected:
  Junctions() : tiles_(comb_.build.build(), static_cast<std::uint32_t>(GetParam())) {}
  GraphView graph() const { return {tiles_.table(), tiles_.leaves(), Grid()}; }
  // x um along the spine, which runs from parent to child.
  ProxyPlace at(double x) const {
    const auto child = static_cast<std::size_t>(std::ceil(x));
    const NodeId id = comb_.build.id(comb_.spine[child]);
    return placeOn(tiles_, {id.cell, id.sample}, static_cast<double>(child) - x);
  }
  Comb comb_;
  test::TiledGraph tiles_;
};

TEST_P(Junctions, FindTheNearestForkWhateverTheTiling) {
  const JunctionSearch search = findJunction(graph(), at(17.25), Vector3d::Zero(), 100, 3);
  ASSERT_TRUE(search.junction);
  EXPECT_NEAR(search.junction->distance_um, 2.75, 1e-9);
  EXPECT_LT((search.junction->p_W - Vector3d(20, 0, 0)).norm(), 1e-9);
  ASSERT_EQ(search.junction->branches.size(), 3u);
  EXPECT_TRUE(search.absent.empty());
  for (const Branch& branch : search.junction->branches) {
    double length = 0;
    for (std::size_t i = 1; i < branch.points_W.size(); ++i)
      length += (branch.points_W[i] - branch.points_W[i - 1]).norm();
    EXPECT_NEAR(length, 3, 1e-9);
    EXPECT_EQ(branch.points_W.front(), Vector3d(20, 0, 0));
    EXPECT_EQ(branch.own, (branch.points_W.back() - Vector3d(17, 0, 0)).norm() < 1e-9);
  }
}

TEST_P(Junctions, TheForkAheadIsPreferred) {
  const JunctionSearch ahead = findJunction(graph(), at(18), {-1, 0.2, 0}, 100, 3);
  ASSERT_TRUE(ahead.junction);
  EXPECT_NEAR(ahead.junction->p_W.x(), 10, 1e-9);
  EXPECT_NEAR(ahead.junction->distance_um, 8, 1e-9);
  const JunctionSearch behind = findJunction(graph(), at(35), {1, 0, 0}, 100, 3);  // ahead there is only the tip
  ASSERT_TRUE(behind.junction);
  EXPECT_NEAR(behind.junction->p_W.x(), 30, 1e-9);
}

TEST_P(Junctions, NothingBeyondReachOrVisits) {
  EXPECT_FALSE(findJunction(graph(), at(15), Vector3d::Zero(), 4.9, 3).junction);
  EXPECT_TRUE(findJunction(graph(), at(15), Vector3d::Zero(), 5.1, 3).junction);
  EXPECT_FALSE(findJunction(graph(), at(15), Vector3d::Zero(), 100, 3, 2).junction);
  EXPECT_FALSE(findJunction(graph(), ProxyPlace{}, Vector3d::Zero(), 100, 3).junction);
}

TEST_P(Junctions, AtTheForkItself) {
  const JunctionSearch search = findJunction(graph(), at(20), Vector3d::Zero(), 1, 3);
  ASSERT_TRUE(search.junction);
  EXPECT_EQ(search.junction->distance_um, 0);
  EXPECT_EQ(std::count_if(search.junction->branches.begin(), search.junction->branches.end(),
                          [](const Branch& b) { return b.own; }),
            1);
}

TEST_P(Junctions, AbsentTilesAreReportedAndLoadingThemContinuesTheSearch) {
  const ProxyPlace place = at(15.5);
  tiles_.dropAll();
  tiles_.load(place.tile);
  JunctionSearch search = findJunction(graph(), place, Vector3d::Zero(), 100, 3);
  int rounds = 0;
  while (!search.absent.empty() && ++rounds < 100) {
    for (const TileId tile : search.absent) tiles_.load(tile);
    search = findJunction(graph(), place, Vector3d::Zero(), 100, 3);
  }
  ASSERT_TRUE(search.junction);
  EXPECT_NEAR(search.junction->p_W.x(), 20, 1e-9);
  EXPECT_EQ(rounds > 0, GetParam() < 1000);
}

INSTANTIATE_TEST_SUITE_P(Capacities, Junctions, ::testing::Values(2, 8, 1000));

TEST(Junction, EndsOnLoops) {
  std::mt19937_64 random(3);
  const test::TestGraph graph = test::randomGraph(random, 300, true);
  const test::TiledGraph tiles(graph, 32);
  const GraphView view(tiles.table(), tiles.leaves(), graph.grid);
  int found = 0;
  for (const StoredSegment& s : graph.segments) {
    const ProxyPlace place = view.placeAt(tiles.tileOf(s.id), s.id, 0.5);
    const JunctionSearch search = findJunction(view, place, Vector3d::Zero(), 1e9, 5);
    if (!search.junction) continue;
    ++found;
    EXPECT_GT(search.junction->branches.size(), 2u);
  }
  EXPECT_GT(found, 100);
}

}  // namespace
}  // namespace filiform
