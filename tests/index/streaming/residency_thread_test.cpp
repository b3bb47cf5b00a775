#include "index/errors.h"
#include "index/file/faulty_source.h"
#include "index/ingest/ingest.h"
#include "index/set/tile_set.h"
#include "tests/index/streaming/residency_fixture.h"
#include "tests/support/campaign.h"
#include "tests/support/temp_folder.h"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <future>
#include <mutex>
#include <random>
#include <thread>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::ResidencyTest;

// ---- threads

TEST_F(ResidencyTest, ThreadIsStartedOnceAndStoppedAsOftenAsOneLikes) {
  Residency residency(*store_, options(UINT64_MAX));
  residency.addReader("hand");
  residency.start();
  EXPECT_THROW(residency.start(), std::logic_error);
  EXPECT_THROW(residency.serve(0), std::logic_error);
  EXPECT_THROW(residency.advance(0, 0), std::logic_error);
  EXPECT_THROW(residency.addReader("late"), std::logic_error);
  residency.stop();
  residency.stop();
  residency.start();
}

// A store whose entries cannot be read for some time.
class LostDirectory final : public test::CountingStore {
 public:
  using CountingStore::CountingStore;
  const TileEntry& entry(TileId tile) const override {
    if (lost) throw IoError("directory.bin", "cannot be read");
    return CountingStore::entry(tile);
  }
  std::atomic<bool> lost{false};
};

TEST_F(ResidencyTest, ADirectoryThatCannotBeReadIsReportedAndTriedAgain) {
  LostDirectory store(*store_);
  Residency residency(store, options(UINT64_MAX));
  TileReader& reader = residency.addReader("hand");
  store.lost = true;
  residency.start();
  const auto wait = [&](auto until) {
    for (int i = 0; i < 20000 && !until(); ++i) {
      reader.apply(8);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return until();
  };
  reader.publishFocus(focusOn(3, 80));
  EXPECT_TRUE(wait([&] { return !residency.failures().empty(); }));
  EXPECT_EQ(reader.tiles().size(), 0u);
  store.lost = false;
  EXPECT_TRUE(wait([&] { return reader.tiles().find(3) != nullptr; }));
  EXPECT_TRUE(wait([&] { return residency.failures().empty(); }));
}

// Reads wait until they are answered.
class SilentDisk {
 public:
  void wait() {
    std::unique_lock lock(mutex_);
    const int mine = answers_;
    ++waiting_;
    changed_.notify_all();
    changed_.wait(lock, [&] { return answers_ != mine || healed_; });
  }
  bool isWaitedFor() {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::seconds(60), [&] { return waiting_ > 0; });
  }
  void answer(bool for_ever = false) {  // the waiting reads
    const std::lock_guard lock(mutex_);
    ++answers_;
    waiting_ = 0;
    healed_ |= for_ever;
    changed_.notify_all();
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  int waiting_ = 0, answers_ = 0;
  bool healed_ = false;
};

TEST_F(ResidencyTest, NobodyElseWaitsWhileTheDiskIsSilent) {
  const test::TempFolder folder;
  {
    CellList cells(test::randomColumn(5, 10, 500, 300));
    ingest(cells, folder / "a.fil", {.capacity = 64});
  }
  for (const PrefetchPolicy policy : {PrefetchPolicy::distance, PrefetchPolicy::structure})
    for (const unsigned threads : {1u, 2u}) {
      SilentDisk disk;
      auto source = std::make_unique<FaultySource>(
          openFolder(folder / "a.fil"),
          FaultPlan{.delay = FaultPlan::Delay::constant, .delay_s = 1, .wait = [&](double) { disk.wait(); }});
      FaultySource& faults = *source;
      const auto set = TileSet::open(std::move(source));
      ASSERT_GT(set->tile_count(), 64u);
      ResidencyOptions how = options(UINT64_MAX, policy);
      how.io_threads = threads;
      Residency residency(*set, how);
      TileReader& reader = residency.addReader("hand");
      faults.arm();
      residency.start();
      ReaderFocus focus;
      focus.active_tile = 3;
      focus.active_node = {2, 0};
      focus.radius_um = 50;
      reader.publishFocus(focus);
      // The first reads are the cell's list (structure) and the directory; tiles follow.
      for (int step = 0; step < 3; ++step) {
        SCOPED_TRACE(step);
        const bool waited_for = disk.isWaitedFor();
        EXPECT_TRUE(waited_for);
        auto asked = std::async(std::launch::async, [&] {
          const HoldId hold = residency.hold(std::vector<TileId>{1}, HoldKind::cell);
          residency.isHeld(hold);
          residency.release(hold);
          return residency.counters().reads + residency.failures().size() +
                 (residency.state(3) == TileState::resident ? 1 : 0);
        });
        const bool answered = asked.wait_for(std::chrono::seconds(30)) == std::future_status::ready;
        EXPECT_TRUE(answered) << "the lock is held during a read";
        disk.answer(!answered || !waited_for);
        asked.get();
        if (!answered || !waited_for) break;
      }
      disk.answer(true);
      for (int i = 0; i < 20000 && reader.tiles().find(3) == nullptr; ++i) {
        reader.apply(8);
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
      EXPECT_NE(reader.tiles().find(3), nullptr);
      residency.stop();
      EXPECT_TRUE(residency.failures().empty());
    }
}

class ThreadedResidency : public ResidencyTest, public testing::WithParamInterface<unsigned> {};
INSTANTIATE_TEST_SUITE_P(IoThreads, ThreadedResidency, testing::Values(1u, 4u));

TEST_P(ThreadedResidency, KeepsEveryPromiseUnderLoad) {
  const std::uint64_t budget = Residency::floorBytes(*store_) + total() / 5;
  store_->failLoads(3);
  store_->jitterLoads(std::chrono::microseconds(300));
  ResidencyOptions many = options(budget, PrefetchPolicy::structure);
  many.io_threads = GetParam();
  Residency residency(*store_, many);
  std::vector<TileReader*> readers = {&residency.addReader("hand"), &residency.addReader("eye")};
  residency.start();
  std::atomic<bool> done{false};
  std::atomic<int> wrong{0};
  std::vector<std::thread> threads;
  for (std::size_t r = 0; r < readers.size(); ++r)
    threads.emplace_back([&, r] {
      std::mt19937_64 random(100 + r);
      TileReader& reader = *readers[r];
      while (!done) {
        const auto active = static_cast<TileId>(random() % count());
        ReaderFocus focus = focusOn(active, 80);
        focus.active_node = {0, static_cast<std::uint32_t>(random() % 400)};
        reader.publishFocus(focus);
        for (int i = 0; i < 40; ++i) {
          // Sometimes a reader pauses, and its messages wait.
          if (random() % 64 == 0) std::this_thread::sleep_for(std::chrono::microseconds(random() % 3000));
          reader.apply(r == 0 ? 8 : 1);
          const auto id = static_cast<TileId>(random() % count());
          if (const Tile* tile = reader.tiles().find(id)) {
            wrong += tile->id() != id || tile->segment_count() == 0;
          } else {
            reader.request(id);
          }
          std::this_thread::sleep_for(std::chrono::microseconds(50));
        }
      }
    });
  // Until enough has happened, however slow the machine.
  const std::uint64_t enough = test::wholeCampaign() ? 100000 : 1500;
  while (residency.counters().reads < enough && wrong == 0) {
    const ResidencyCounters c = residency.counters();
    wrong += c.bytes > budget || c.peak_bytes > budget;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  done = true;
  for (std::thread& thread : threads) thread.join();
  residency.stop();
  EXPECT_EQ(wrong, 0);
  EXPECT_LE(store_->peakHeldBytes(), budget);
  EXPECT_GT(residency.counters().evictions, 100u);
  EXPECT_EQ(residency.failures().size(), 1u);
  test::tell(std::to_string(residency.counters().reads) + " tiles read by " + std::to_string(GetParam()) +
             " IO threads for two readers, " + std::to_string(residency.counters().evictions) +
             " let go again: every promise kept, budget never exceeded");
}

}  // namespace
}  // namespace filiform
