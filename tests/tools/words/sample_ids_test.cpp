#include "tools/words/sample_ids.h"

#include "index/errors.h"
#include "index/query/nearest.h"
#include "index/set/forwarding_store.h"
#include "tests/support/scenes/memory_store.h"
#include "tests/support/scenes/random_cells.h"

#include <atomic>
#include <chrono>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

// Says that it is at an address. Reads of details take a moment; counts them, and those under way.
class FarDetails final : public ForwardingStore {
 public:
  using ForwardingStore::ForwardingStore;
  bool isRemote() const override { return true; }
  CellDetail loadCellDetail(std::uint32_t id) const override {
    ++reads;
    const int now = ++under_way;
    for (int most = most_under_way; now > most && !most_under_way.compare_exchange_weak(most, now);) {
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    --under_way;
    if (id == fails) throw IoError("cells.bin", "an injected fault");
    return store_.loadCellDetail(id);
  }
  mutable std::atomic<int> reads{0}, under_way{0}, most_under_way{0};
  std::atomic<std::uint32_t> fails{UINT32_MAX};
};

class SampleIdsTest : public ::testing::Test {
 protected:
  const std::unique_ptr<TileStore> tiles_ = test::storeOf(test::randomColumn(5, 12, 100, 300), 64);
  FarDetails far_{*tiles_};
  SampleIds ids_{far_, 1 << 20};
};

TEST_F(SampleIdsTest, CellsOfResultsAreReadTogetherAndOnce) {
  std::vector<NearestResult> results(40);
  for (std::uint32_t i = 0; i < results.size(); ++i) results[i].segment = {i % 8, 0};
  ids_.readAhead(results);
  EXPECT_EQ(far_.reads, 8);
  EXPECT_GE(far_.most_under_way, 4);
  for (const NearestResult& result : results) ids_.cell(result.segment.cell);
  EXPECT_EQ(far_.reads, 8);
  for (auto& result : results) result.segment.cell = result.segment.cell == 0 ? 9 : 10;
  results.resize(1);
  ids_.readAhead(results);
  EXPECT_EQ(far_.reads, 8) << "one cell is left to its use";
}

TEST_F(SampleIdsTest, CellThatCannotBeReadIsLeftToItsUse) {
  far_.fails = 2;
  ids_.readAhead(std::vector<std::uint32_t>{1, 2, 3});
  EXPECT_THROW(ids_.cell(2), IoError);
  far_.fails = UINT32_MAX;
  EXPECT_NO_THROW(ids_.cell(2));
}

}  // namespace
}  // namespace filiform::tools
