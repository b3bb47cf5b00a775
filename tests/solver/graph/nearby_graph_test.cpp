#include "solver/graph/nearby_graph.h"

#include "index/ingest/memory_tiles.h"
#include "index/query/nearest.h"
#include "tests/support/scenes/random_cells.h"

#include <algorithm>
#include <map>
#include <memory>
#include <set>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

class NearbyGraphs : public ::testing::Test {
 protected:
  void build(std::uint32_t capacity) {
    CellList cells(test::randomColumn(21, 4, 300, 200));
    store_ = buildTilesInMemory(cells, {.capacity = capacity});
    table_ = std::make_unique<TileTable>(store_->tile_count());
    tiles_.clear();
    for (TileId tile = 0; tile < store_->tile_count(); ++tile) {
      tiles_.push_back(store_->load(tile));
      table_->add(*tiles_.back());
    }
    graph_ = std::make_unique<GraphView>(*table_, store_->leaves(), store_->grid());
  }
  ProxyPlace near(const Vector3d& p_W) const {
    const NearestResult found = Nearest(*store_).find(p_W).at(0);
    return graph_->placeAt(found.tile, found.segment, found.t);
  }
  std::unique_ptr<TileStore> store_;
  std::vector<std::shared_ptr<const Tile>> tiles_;
  std::unique_ptr<TileTable> table_;
  std::unique_ptr<GraphView> graph_;
};

using Links = std::set<std::pair<std::vector<double>, std::vector<double>>>;
Links linksOf(const NearbyGraph& graph) {
  Links links;
  const auto point = [&](std::uint16_t at) {
    const Vector3d& p = graph.nodes()[at];
    return std::vector<double>{p.x(), p.y(), p.z()};
  };
  for (const auto& [a, b] : graph.links()) links.insert({std::min(point(a), point(b)), std::max(point(a), point(b))});
  return links;
}

// With a large radius: the whole tree of the place, each segment once, whatever the tiling.
TEST_F(NearbyGraphs, HasEverySegmentOfTheTreeOnce) {
  std::map<int, Links> found;
  for (const std::uint32_t capacity : {8u, 4096u}) {
    build(capacity);
    NearbyGraph graph(4096);
    graph.collect(*graph_, near({20, 30, 10}), 1e9);
    EXPECT_FALSE(graph.full());
    const std::uint32_t cell = near({20, 30, 10}).segment.cell;
    EXPECT_GT(graph.links().size(), 20u);
    EXPECT_LE(graph.links().size(), store_->cell(cell).segments);
    EXPECT_EQ(linksOf(graph).size(), graph.links().size());
    found[static_cast<int>(capacity)] = linksOf(graph);
  }
  EXPECT_EQ(found[8], found[4096]);
}

TEST_F(NearbyGraphs, BeginsWithThePlacesSegmentAndStaysInTheRadius) {
  build(32);
  NearbyGraph graph(4096);
  const ProxyPlace place = near({0, 50, 0});
  graph.collect(*graph_, place, 30);
  ASSERT_GE(graph.links().size(), 1u);
  EXPECT_EQ(graph.links()[0], (NearbyGraph::Link{0, 1}));
  const GraphView::SegmentRef segment = graph_->segment(place.tile, place.segment);
  EXPECT_EQ(graph.nodes()[0], segment.tile->position_W(segment.tile->child(segment.segment)));
  EXPECT_EQ(graph.nodes()[1], segment.tile->position_W(segment.tile->parent(segment.segment)));
  for (const auto& [a, b] : graph.links())
    if (a > 1 && b > 1) {
      EXPECT_LE(std::min((graph.nodes()[a] - place.p_W).norm(), (graph.nodes()[b] - place.p_W).norm()), 30);
    }
}

TEST_F(NearbyGraphs, StopsWhenTheListIsFullAndAtAbsentTiles) {
  build(8);
  NearbyGraph graph(20);
  const ProxyPlace place = near({20, 30, 10});
  graph.collect(*graph_, place, 1e9);
  EXPECT_TRUE(graph.full());
  EXPECT_EQ(graph.nodes().size(), 20u);
  for (const auto& [a, b] : graph.links()) EXPECT_LT(std::max(a, b), 20);
  for (TileId tile = 0; tile < store_->tile_count(); ++tile)
    if (tile != place.tile) table_->retire(tile);
  NearbyGraph less(4096);
  less.collect(*graph_, place, 1e9);
  EXPECT_FALSE(less.full());
  EXPECT_GE(less.nodes().size(), 2u);
  table_->retire(place.tile);
  less.collect(*graph_, place, 1e9);
  EXPECT_TRUE(less.nodes().empty());
  less.collect(*graph_, {}, 1e9);
  EXPECT_TRUE(less.links().empty());
}

}  // namespace
}  // namespace filiform
