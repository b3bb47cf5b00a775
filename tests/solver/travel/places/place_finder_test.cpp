#include "solver/travel/places/place_finder.h"

#include "index/errors.h"
#include "index/ingest/memory_tiles.h"
#include "tests/support/scenes/counting_store.h"
#include "tests/support/scenes/random_cells.h"

#include <gtest/gtest.h>

namespace filiform {
namespace {

// What the whole cell says: its first root of type 1, else its first root.
std::uint32_t rootOf(const CellGraph& graph) {
  std::uint32_t first = kNoParent;
  for (std::uint32_t node = 0; node < graph.samples(); ++node) {
    if (graph.parents[node] != kNoParent) continue;
    if (graph.types[node] == kSomaType) return node;
    first = std::min(first, node);
  }
  return first;
}

TEST(PlaceFinder, TheSomaIsTheOneThatTheWholeCellShows) {
  CellList cells(test::randomColumn(11, 30, 300, 200));
  const auto store = buildTilesInMemory(cells, {.capacity = 50});
  const PlaceFinder finder(*store);
  for (std::uint32_t cell = 0; cell < store->cell_count(); ++cell) {
    const CellGraph graph = readCell(*store, cell, true);
    const std::uint32_t root = rootOf(graph);
    const ProxyPlace place = finder.soma(cell);
    ASSERT_TRUE(place.valid()) << cell;
    EXPECT_TRUE(place.at_node) << cell;
    EXPECT_EQ(place.node, (NodeId{cell, root})) << cell;
    EXPECT_EQ(place.p_W, graph.position_W(root)) << cell;
    EXPECT_EQ(place.segment.cell, cell);
  }
}

TEST(PlaceFinder, ASomaIsFoundWithoutReadingTheWholeCell) {
  CellList cells(test::randomColumn(12, 20, 2000, 200));
  const auto built = buildTilesInMemory(cells, {.capacity = 50});
  std::size_t tiles = 0, loads = 0;
  for (std::uint32_t cell = 0; cell < built->cell_count(); ++cell) {
    const test::CountingStore store(*built);
    PlaceFinder(store).soma(cell);
    tiles += store.loadCellDetail(cell).tiles.size();
    loads += store.loads().size();
  }
  EXPECT_GT(tiles, 400u);
  EXPECT_LT(loads, tiles);  // the home of the root included, which is read once
}

TEST(PlaceFinder, APlaceNearAPointTakesOneTileAndIsTheNearestThere) {
  CellList cells(test::randomColumn(13, 20, 2000, 200));
  const auto built = buildTilesInMemory(cells, {.capacity = 50});
  std::size_t exact_loads = 0;
  int same = 0;
  for (int i = 0; i < 40; ++i) {
    const Vector3d p_W(7.0 * i - 140, 200 - 9.0 * i, 5.0 * i - 100);
    const TileId home = built->home(built->grid().snap(p_W));
    const test::CountingStore exactly(*built), roughly(*built);
    const auto nearest = PlaceFinder(exactly).nearest(p_W);
    const auto near = PlaceFinder(roughly).anyNear(p_W);
    ASSERT_TRUE(nearest && near);
    ASSERT_TRUE(near->place.valid());
    EXPECT_NEAR((near->place.p_W - p_W).norm(), near->distance_um, 1e-9) << i;
    EXPECT_GE(near->distance_um, nearest->distance_um - 1e-9) << i;
    exact_loads += exactly.loads().size();
    if (home == kNoTile || built->load(home)->segment_count() == 0) {
      EXPECT_EQ(near->distance_um, nearest->distance_um) << i;
      continue;
    }
    EXPECT_EQ(roughly.loads().size(), 1u) << i;
    same += near->distance_um < nearest->distance_um + 1e-9 ? 1 : 0;
  }
  EXPECT_GT(same, 0);
  EXPECT_GT(exact_loads, 40u);
}

}  // namespace
}  // namespace filiform
