#include "solver/graph/graph_view.h"

#include "index/geometry/closest_point.h"
#include "tests/support/no_alloc_guard.h"
#include "tests/support/scenes/paper_oracle.h"
#include "tests/support/scenes/proxy_walk.h"
#include "tests/support/scenes/test_graph.h"

#include <algorithm>
#include <limits>
#include <random>

#include <gtest/gtest.h>

namespace filiform::test {
namespace {

TEST(GraphView, FindsEveryNodeWithAllItsSegmentsFromWhereverItIsStored) {
  for (const std::uint32_t capacity : {4u, 16u, 2048u}) {
    SCOPED_TRACE(testing::Message() << "capacity " << capacity);
    std::mt19937_64 random(capacity);
    const TestGraph graph = randomGraph(random, 300, true);
    const WholeGraph whole(graph.segments, graph.grid);
    const TiledGraph tiled(graph, capacity);
    const GraphView view = viewOf(tiled, graph);
    std::size_t from_elsewhere = 0;
    for (TileId id = 0; id < tiled.tile_count(); ++id) {
      const Tile& tile = tiled.tile(id);
      for (std::uint32_t node = 0; node < tile.node_count(); ++node) {
        const GraphView::HomeNode home = view.home(tile, node);
        ASSERT_TRUE(home.present());
        ASSERT_FALSE(home.frontier());
        ASSERT_EQ(home.home, home.tile->id());
        ASSERT_EQ(view.homeId(tile, node), home.home);
        ASSERT_EQ(home.tile->nodeId(home.node), tile.nodeId(node));
        ASSERT_EQ(view.home(tile.nodeId(node), tile.gridPoint(node)).home, home.home);
        from_elsewhere += home.home != id;
        const WholeGraph::Node& expected = whole.nodes()[whole.node(tile.nodeId(node))];
        const auto incident = home.tile->incident(home.node);
        ASSERT_EQ(incident.size(), expected.incident.size());
        for (std::size_t i = 0; i < incident.size(); ++i)
          ASSERT_EQ(home.tile->segmentId(incident[i]), whole.segments()[expected.incident[i]].id);
      }
    }
    if (capacity == 4) {
      EXPECT_GT(from_elsewhere, 50u);
    }
  }
}

TEST(GraphView, ReportsAnAbsentHomeWhateverElseIsResident) {
  std::mt19937_64 random(2);
  const TestGraph graph = randomGraph(random, 200, false);
  TiledGraph tiled(graph, 8);
  const GraphView view = viewOf(tiled, graph);
  std::size_t frontiers = 0;
  for (TileId id = 0; id < tiled.tile_count(); ++id) {
    const Tile& tile = tiled.tile(id);
    for (std::uint32_t node = 0; node < tile.node_count(); ++node) {
      const TileId home = view.homeId(tile, node);
      if (home == id) continue;
      tiled.drop(home);
      const GraphView::HomeNode absent = view.home(tile, node);
      ASSERT_TRUE(absent.frontier());
      ASSERT_FALSE(absent.present());
      ASSERT_EQ(absent.home, home);
      tiled.load(home);
      ASSERT_TRUE(view.home(tile, node).present());
      ++frontiers;
    }
  }
  EXPECT_GT(frontiers, 20u);
}

TEST(GraphView, ANodeThatNoLeafHoldsIsADeadEndAndNoFrontier) {
  std::mt19937_64 random(3);
  const TestGraph graph = randomGraph(random, 50, false);
  const TiledGraph tiled(graph, 4);
  const GraphView view = viewOf(tiled, graph);
  const Tile& tile = tiled.tile(0);
  const GraphView::HomeNode unknown = view.home(NodeId{1000, 1000}, tile.gridPoint(0));
  EXPECT_FALSE(unknown.present());
  EXPECT_FALSE(unknown.frontier());
  const GraphView::HomeNode nowhere = view.home(tile.nodeId(0), GridPoint::Constant(std::int64_t{1} << 40));
  EXPECT_FALSE(nowhere.present());
  EXPECT_FALSE(nowhere.frontier());
}

TEST(GraphView, PlacesLieWhereTheClosestPointIs) {
  std::mt19937_64 random(4);
  const TestGraph graph = randomGraph(random, 200, true);
  const WholeGraph whole(graph.segments, graph.grid);
  for (const std::uint32_t capacity : {4u, 2048u}) {
    const TiledGraph tiled(graph, capacity);
    const GraphView view = viewOf(tiled, graph);
    for (const Vector3d& h_W : jumpingProbes(whole, random, 300)) {
      const WholeGraph::Segment& s = whole.segments()[random() % whole.segments().size()];
      const ClosestPoint q = closestPoint(whole.nodes()[s.child].p_W, whole.nodes()[s.parent].p_W, h_W);
      for (TileId id = 0; id < tiled.tile_count(); ++id) {
        const ProxyPlace place = view.placeAt(id, s.id, q.t);
        if (!tiled.tile(id).findSegment(s.id)) {
          ASSERT_FALSE(place.valid());
          continue;
        }
        ASSERT_TRUE(place.valid());
        ASSERT_EQ(place.segment, s.id);
        ASSERT_EQ(place.t, q.t);
        ASSERT_TRUE((place.p_W.array() == q.p_W.array()).all());
        ASSERT_EQ(place.at_node, q.t == 0.0 || q.t == 1.0);
        if (place.at_node) {
          const WholeGraph::Node& node = whole.nodes()[q.t == 0.0 ? s.child : s.parent];
          ASSERT_EQ(place.node, node.id);
          ASSERT_TRUE(view.nodeIn(place.tile, node.id).present());
          ASSERT_EQ(place.tile, tiled.leaves().home(graph.grid.snap(node.p_W)));
        } else {
          ASSERT_EQ(place.tile, id);
        }
      }
    }
  }
}

TEST(GraphView, PlaceAtClampsAndRefuses) {
  TestGraphBuilder builder;
  const std::uint32_t root = builder.node(Vector3d(0, 0, 0));
  builder.link(builder.node(Vector3d(2, 0, 0)), root);
  builder.link(builder.node(Vector3d(0, 0, 0)), root);  // length zero
  const TestGraph graph = builder.build();
  TiledGraph tiled(graph, 100);
  const GraphView view = viewOf(tiled, graph);
  EXPECT_EQ(view.placeAt(0, {0, 1}, 0.25).p_W, Vector3d(1.5, 0, 0));
  EXPECT_FALSE(view.placeAt(0, {0, 1}, 0.25).at_node);
  EXPECT_EQ(view.placeAt(0, {0, 1}, -1).node, (NodeId{0, 1}));
  EXPECT_EQ(view.placeAt(0, {0, 1}, -1).t, 0.0);
  EXPECT_EQ(view.placeAt(0, {0, 1}, 7).node, (NodeId{0, 0}));
  EXPECT_EQ(view.placeAt(0, {0, 1}, 7).t, 1.0);
  EXPECT_TRUE(view.placeAt(0, {0, 2}, 0.5).at_node);
  EXPECT_FALSE(view.placeAt(0, {0, 1}, std::numeric_limits<double>::quiet_NaN()).valid());
  EXPECT_FALSE(view.placeAt(0, {0, 9}, 0.5).valid());
  EXPECT_FALSE(view.placeAt(1, {0, 1}, 0.5).valid());
  EXPECT_FALSE(view.placeAt(kNoTile, {0, 1}, 0.5).valid());
  EXPECT_TRUE(view.segment(0, {0, 1}));
  EXPECT_FALSE(view.segment(0, {1, 1}));
  tiled.drop(0);
  EXPECT_FALSE(view.segment(0, {0, 1}));
  EXPECT_FALSE(view.placeAt(0, {0, 1}, 0.5).valid());
}

TEST(GraphView, NeitherAllocatesNorLocksNorCallsTheSystem) {
  std::mt19937_64 random(5);
  const TestGraph graph = randomGraph(random, 200, true);
  const TiledGraph tiled(graph, 4);
  double sum = 0;
  NoAllocGuard guard;
  const GraphView view = viewOf(tiled, graph);
  for (TileId id = 0; id < tiled.tile_count(); ++id) {
    const Tile& tile = tiled.tile(id);
    for (std::uint32_t node = 0; node < tile.node_count(); ++node) sum += view.home(tile, node).node;
    for (std::uint32_t s = 0; s < tile.segment_count(); ++s)
      for (const double t : {0.0, 0.5, 1.0}) sum += view.placeAt(id, tile.segmentId(s), t).t;
  }
  const ForbiddenCalls calls = guard.calls();
  EXPECT_EQ(calls.total(), 0u) << calls.first;
  EXPECT_GT(sum, 0);
}

}  // namespace
}  // namespace filiform::test
