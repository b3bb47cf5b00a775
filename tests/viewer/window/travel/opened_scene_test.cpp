#include "viewer/window/travel/opened_scene.h"

#include "index/ingest/ingest.h"
#include "tests/support/scenes/far_folder.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/temp_folder.h"

#include <atomic>

#include <gtest/gtest.h>

namespace filiform {
namespace {

TEST(OpenedSceneTest, WithoutLevelsAPictureOfAFarSetNeedsNoMoreOfTheDirectory) {
  for (const bool has_levels : {true, false}) {
    test::TempFolder folder;
    CellList cells(test::randomColumn(5, 4, 500, 300));
    ingest(cells, folder / "a.fil", {.capacity = 16, .levels = has_levels});
    auto far = std::make_unique<test::FarFolder>(folder / "a.fil");
    const std::atomic<int>& reads = far->directory_reads;
    OpenedScene scene;
    scene.hold(TileSet::open(std::move(far)));
    EXPECT_EQ(scene.revision, TileSet::open(folder / "a.fil")->revision());
    EXPECT_TRUE(scene.network);
    EXPECT_EQ(scene.open_levels() != nullptr, has_levels);
    const int before = reads;
    for (TileId tile = 0; tile < scene.store->tile_count(); ++tile) scene.store->entry(tile);
    if (has_levels) {
      EXPECT_GT(reads, before) << "the whole directory was read";
    } else {
      EXPECT_EQ(reads, before);
    }
  }
}

}  // namespace
}  // namespace filiform
