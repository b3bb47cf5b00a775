#include "index/set/tiles_ahead.h"

#include "index/build/ingest.h"
#include "index/errors.h"
#include "index/set/tile_set.h"
#include "tests/support/random_cells.h"
#include "tests/support/sanitized.h"
#include "tests/support/temp_folder.h"
#include "tests/support/tile_invariants.h"

#include <atomic>
#include <chrono>
#include <numeric>
#include <thread>

#include <gtest/gtest.h>

namespace filiform {
namespace {

// A folder whose reads of tiles take some time; counts those under way.
class SlowFolder final : public TileSource {
 public:
  SlowFolder(const std::string& path, bool remote) : source_(openFolder(path)), remote_(remote) {}
  std::uint64_t size(const std::string& name) const override { return source_->size(name); }
  std::string describe(const std::string& name) const override { return source_->describe(name); }
  bool isRemote() const override { return remote_; }
  void read(const std::string& name, std::uint64_t offset, std::span<std::uint8_t> bytes) const override {
    if (name.ends_with(".pack")) {
      const int now = ++under_way;
      for (int most = most_under_way; now > most && !most_under_way.compare_exchange_weak(most, now);) {
      }
      if (++reads == fail_at) throw IoError(describe(name), "an injected fault");
      std::this_thread::sleep_for(std::chrono::milliseconds(remote_ ? 20 : 1));
      --under_way;
    }
    source_->read(name, offset, bytes);
  }
  mutable std::atomic<int> under_way{0}, most_under_way{0}, reads{0};
  int fail_at = 0;

 private:
  std::unique_ptr<TileSource> source_;
  bool remote_;
};

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
