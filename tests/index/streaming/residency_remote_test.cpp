// Residency over a slow source: many reads at once, and no thread waits for another's.
#include "index/ingest/ingest.h"
#include "index/set/tile_set.h"
#include "index/streaming/internal/read_latency.h"
#include "index/streaming/internal/reads_in_flight.h"
#include "index/streaming/residency.h"
#include "tests/support/sanitized.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/temp_folder.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

#include <gtest/gtest.h>

namespace filiform {
namespace {

// A folder that says that it is far away. Reads of some files wait.
class FarFolder final : public TileSource {
 public:
  struct Gate {
    std::mutex mutex;
    std::condition_variable changed;
    std::vector<std::string> held;         // reads of files with these endings wait
    int waiting = 0, most = 0, packs = 0;  // now, at once, of packs in all
    std::chrono::milliseconds slow{0};     // each read takes this long

    void hold(const std::vector<std::string>& endings) {
      const std::lock_guard lock(mutex);
      held = endings;
      changed.notify_all();
    }
    bool holds(const std::string& name) const {
      return std::any_of(held.begin(), held.end(), [&](const std::string& ending) { return name.ends_with(ending); });
    }
    int packsAsked() {
      const std::lock_guard lock(mutex);
      return packs;
    }
  };
  FarFolder(const std::string& path, Gate& gate) : source_(openFolder(path)), gate_(gate) {}
  std::uint64_t size(const std::string& name) const override { return source_->size(name); }
  std::string describe(const std::string& name) const override { return source_->describe(name); }
  bool isRemote() const override { return true; }
  void read(const std::string& name, std::uint64_t offset, std::span<std::uint8_t> bytes) const override {
    {
      std::unique_lock lock(gate_.mutex);
      gate_.most = std::max(gate_.most, ++gate_.waiting);
      gate_.packs += name.ends_with(".pack");
      gate_.changed.notify_all();
      gate_.changed.wait(lock, [&] { return !gate_.holds(name); });
    }
    std::this_thread::sleep_for(gate_.slow);
    {
      const std::lock_guard lock(gate_.mutex);
      --gate_.waiting;
    }
    source_->read(name, offset, bytes);
  }

 private:
  std::unique_ptr<TileSource> source_;
  Gate& gate_;
};

class ResidencyRemoteTest : public ::testing::Test {
 protected:
  ResidencyRemoteTest() {
    CellList cells(test::randomColumn(5, 10, 500, 300));
    ingest(cells, folder_ / "a.fil", {.capacity = 64, .page_tiles = 4});
    set_ = openFar();
    for (TileId t = 0; t < set_->tile_count(); ++t) set_->entry(t);
  }
  std::unique_ptr<TileSet> openFar() { return TileSet::open(std::make_unique<FarFolder>(folder_ / "a.fil", gate_)); }
  ~ResidencyRemoteTest() override { gate_.hold({}); }

  static bool eventually(TileReader& reader, const std::function<bool()>& holds) {
    for (int i = 0; i < (test::kSanitized ? 60'000 : 10'000) && !holds(); ++i) {
      reader.apply(64);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return holds();
  }
  static ReaderFocus focus() {
    ReaderFocus focus;
    focus.active_tile = 3;
    focus.active_node = {2, 0};
    focus.radius_um = 200;
    return focus;
  }

  FarFolder::Gate gate_;
  test::TempFolder folder_;
  std::unique_ptr<TileSet> set_;
};

TEST_F(ResidencyRemoteTest, TilesComeWhileTheTilesOfACellAreAskedFor) {
  gate_.hold({"cells.bin"});
  Residency residency(*set_, {});
  TileReader& reader = residency.addReader("hand");
  residency.start();
  std::this_thread::sleep_for(std::chrono::milliseconds(50));  // all threads but one sleep
  reader.publishFocus(focus());
  EXPECT_TRUE(eventually(reader, [&] { return reader.tiles().find(3) != nullptr; }));
  gate_.hold({});
  residency.stop();
}

TEST_F(ResidencyRemoteTest, TheNearestTilesAreAskedForBesideThatOfATarget) {
  const TileId far = set_->tile_count() / 2;
  const std::shared_ptr<const Tile> tile = set_->load(far);
  std::uint32_t node = 0;
  while (!tile->isHome(node)) ++node;
  ReaderFocus jump;
  jump.p_W = Vector3d(1e6, 0, 0);
  jump.radius_um = 800;
  jump.target_tile = far;
  jump.target_node = tile->nodeId(node);
  jump.target_W = tile->position_W(node);
  Residency residency(*set_, {});
  TileReader& reader = residency.addReader("hand");
  reader.publishFocus(jump);
  const int before = gate_.packsAsked();
  gate_.hold({".pack", "cells.bin"});
  residency.start();
  EXPECT_TRUE(eventually(reader, [&] { return gate_.packsAsked() - before >= 4; }))
      << "only " << gate_.packsAsked() - before << " tiles are asked for in the first round";
  EXPECT_FALSE(reader.isTargetReady(jump.target_node));
  gate_.hold({});
  EXPECT_TRUE(eventually(reader, [&] { return reader.isTargetReady(jump.target_node); }));
  residency.stop();
}

TEST_F(ResidencyRemoteTest, ManyReadsAreUnderWayAtOnce) {
  Residency residency(*set_, {.prefetch = PrefetchPolicy::distance});
  TileReader& reader = residency.addReader("hand");
  ReaderFocus wide = focus();
  wide.radius_um = 1e4;
  reader.publishFocus(wide);
  gate_.hold({".pack"});
  residency.start();
  constexpr int kMost = ResidencyOptions::kMostRemoteReads;
  const auto waiting = [&](int count) {
    return [this, count] {
      const std::lock_guard lock(gate_.mutex);
      return gate_.waiting == count;
    };
  };
  EXPECT_TRUE(eventually(reader, waiting(kMost)));
  gate_.hold({});
  EXPECT_TRUE(eventually(reader, [&] { return residency.counters().queued == 0 && residency.counters().reads > 20; }));
  residency.stop();
  EXPECT_LE(gate_.most, kMost);
  EXPECT_GT(residency.counters().read_mean_s, 0);
}

TEST_F(ResidencyRemoteTest, MoreReadsAreUnderWayWhereReadsAreSlow) {
  gate_.slow = std::chrono::milliseconds(20);
  Residency residency(*set_, {.prefetch = PrefetchPolicy::distance});
  TileReader& reader = residency.addReader("hand");
  ReaderFocus far = focus();
  far.radius_um = 1e4;
  reader.publishFocus(far);
  residency.start();
  EXPECT_TRUE(eventually(reader, [&] { return residency.counters().queued == 0 && residency.counters().reads > 40; }));
  residency.stop();
  EXPECT_GT(gate_.most, 8);
  EXPECT_LE(gate_.most, static_cast<int>(ResidencyOptions::kMostRemoteReads));
}

TEST(ReadsInFlight, GrowWhileReadsDoNotWaitForEachOther) {
  internal::ReadsInFlight far(8, 24);
  EXPECT_EQ(far.most(), 24u);
  for (int i = 0; i < 100; ++i) far.add(0.02 + 0.001 * (i % 5));
  EXPECT_EQ(far.most(), 24u);
  for (int i = 0; i < 1000; ++i) far.add(i % 16 == 0 ? 0.02 : 0.3);
  EXPECT_EQ(far.most(), 8u) << "crowded";
  for (int i = 0; i < 2000; ++i) far.add(0.3);
  EXPECT_EQ(far.most(), 24u) << "the path has become longer";
  internal::ReadsInFlight near(8, 24);
  for (int i = 0; i < 100; ++i) near.add(0.001);
  EXPECT_EQ(near.most(), 8u);
  near.add(-1);
  internal::ReadsInFlight fixed(4, 4);
  for (int i = 0; i < 100; ++i) fixed.add(0.02);
  EXPECT_EQ(fixed.most(), 4u);
}

TEST(ReadLatency, FastReadsLookLessFarAhead) {
  internal::ReadLatency latency;
  for (int i = 0; i < 200; ++i) latency.add(0.0002);
  EXPECT_EQ(latency.lookahead_s(0.5), 0.15);
  EXPECT_EQ(latency.lookahead_s(0.1), 0.1) << "less than the least was asked for";
  for (int i = 0; i < 200; ++i) latency.add(0.004);
  EXPECT_NEAR(latency.lookahead_s(0.5), 0.24, 0.01);
  latency.add(0.05);  // one slow read, as of a page that the system has dropped
  EXPECT_EQ(latency.lookahead_s(0.5), 0.5);
}

TEST(ReadLatency, LooksAheadByTwoSlowReads) {
  internal::ReadLatency latency;
  EXPECT_EQ(latency.lookahead_s(0.5), 0.5);
  for (int i = 0; i < 200; ++i) latency.add(0.02);
  EXPECT_NEAR(latency.mean_s(), 0.02, 1e-6);
  EXPECT_EQ(latency.lookahead_s(0.5), 0.5) << "20 ms is short";
  for (int i = 0; i < 200; ++i) latency.add(0.4);
  EXPECT_NEAR(latency.lookahead_s(0.5), 0.8, 0.01);
  for (int i = 0; i < 200; ++i) latency.add(i % 2 == 0 ? 0.1 : 0.3);
  EXPECT_GT(latency.lookahead_s(0.5), 1);
  for (int i = 0; i < 200; ++i) latency.add(100);
  EXPECT_EQ(latency.lookahead_s(0.5), 4);
  latency.add(-1);
  EXPECT_EQ(latency.lookahead_s(0.5), 4);
}

}  // namespace
}  // namespace filiform
