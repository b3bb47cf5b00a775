#include "viewer/window/travel/opened_scene.h"

#include "index/file/tile_source.h"
#include "index/ingest/ingest.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/temp_folder.h"

#include <atomic>

#include <gtest/gtest.h>

namespace filiform {
namespace {

// A folder that says that it is far away.
class FarFolder final : public TileSource {
 public:
  FarFolder(const std::string& path, std::atomic<int>& reads) : source_(openFolder(path)), reads_(reads) {}
  std::uint64_t size(const std::string& name) const override { return source_->size(name); }
  std::string describe(const std::string& name) const override { return source_->describe(name); }
  bool isRemote() const override { return true; }
  void read(const std::string& name, std::uint64_t offset, std::span<std::uint8_t> bytes) const override {
    ++reads_;
    source_->read(name, offset, bytes);
  }

 private:
  std::unique_ptr<TileSource> source_;
  std::atomic<int>& reads_;
};

TEST(OpenedSceneTest, WithoutLevelsAPictureOfAFarSetNeedsNoMoreOfTheDirectory) {
  for (const bool has_levels : {true, false}) {
    test::TempFolder folder;
    CellList cells(test::randomColumn(5, 4, 500, 300));
    ingest(cells, folder / "a.fil", {.capacity = 16, .levels = has_levels});
    std::atomic<int> reads{0};
    OpenedScene scene;
    scene.hold(TileSet::open(std::make_unique<FarFolder>(folder / "a.fil", reads)));
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
