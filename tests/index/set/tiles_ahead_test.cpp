#include "index/set/tiles_ahead.h"

#include "index/errors.h"
#include "index/ingest/ingest.h"
#include "index/set/tile_set.h"
#include "tests/support/sanitized.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/scenes/slow_folder.h"
#include "tests/support/scenes/tile_invariants.h"
#include "tests/support/temp_folder.h"

#include <atomic>
#include <chrono>
#include <numeric>
#include <thread>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::SlowFolder;

class TilesAheadTest : public ::testing::Test {
 protected:
  TilesAheadTest() {
    CellList cells(test::randomColumn(5, 4, 500, 300));
    ingest(cells, folder_ / "a.fil", {.capacity = 64});
    local_ = TileSet::open(folder_ / "a.fil");
    tiles_.resize(std::min<TileId>(local_->tile_count(), test::kSanitized ? 20 : 60));
    std::iota(tiles_.rbegin(), tiles_.rend(), TileId{0});
  }
  SlowFolder& open(bool remote) {
    auto source = std::make_unique<SlowFolder>(folder_ / "a.fil", remote);
    SlowFolder& slow = *source;
    set_ = TileSet::open(std::move(source));
    for (TileId t = 0; t < set_->tile_count(); ++t) set_->entry(t);
    return slow;
  }
  test::TempFolder folder_;
  std::unique_ptr<TileSet> local_, set_;
  std::vector<TileId> tiles_;
};

TEST_F(TilesAheadTest, GivesTheTilesInTheirOrder) {
  for (const bool remote : {false, true}) {
    const SlowFolder& slow = open(remote);
    TilesAhead ahead(*set_, tiles_, true);
    for (const TileId tile : tiles_) {
      const TilesAhead::Loaded loaded = ahead.next();
      test::expectSameTile(*loaded.tile, *local_->load(tile));
      EXPECT_EQ(loaded.appearance.types, local_->loadAppearance(tile).types);
    }
    if (remote) {
      EXPECT_GT(slow.most_under_way, 1);
    } else {
      EXPECT_EQ(slow.most_under_way, 1);
    }
    EXPECT_LE(slow.most_under_way, 2 * static_cast<int>(TilesAhead::kRemoteTiles));
  }
}

TEST_F(TilesAheadTest, AFailureComesInItsTurnAndNothingIsLeftUnderWay) {
  for (const bool remote : {false, true}) {
    SlowFolder& slow = open(remote);
    slow.fail_at = 7;
    std::size_t taken = 0;
    {
      TilesAhead ahead(*set_, tiles_, false);
      EXPECT_THROW(for (; taken < tiles_.size(); ++taken) ahead.next(), IoError);
    }
    if (!remote) {
      EXPECT_EQ(taken, 6u);
    }
    const int reads = slow.reads;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    EXPECT_EQ(slow.reads, reads);
  }
}

}  // namespace
}  // namespace filiform
