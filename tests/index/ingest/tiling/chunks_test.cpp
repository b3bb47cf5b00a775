#include "index/ingest/tiling/internal/chunks.h"

#include "tests/support/temp_folder.h"

#include <algorithm>
#include <atomic>
#include <random>
#include <set>

#include <gtest/gtest.h>

namespace filiform::internal {
namespace {

struct ChunksTest : ::testing::Test {
  // Segments of a dense clump, of wide surroundings and of one place.
  static std::vector<SegmentRecord> segments(std::uint64_t seed, std::uint32_t n) {
    std::mt19937_64 random(seed);
    std::vector<SegmentRecord> records;
    for (std::uint32_t i = 0; i < n; ++i) {
      const std::int64_t extent = i % 3 == 0 ? 1 << 30 : i % 3 == 1 ? 1 << 10 : 1;
      const auto coordinate = [&] { return static_cast<std::int64_t>(random() % (2 * extent)) - extent; };
      const GridPoint p(coordinate(), coordinate(), coordinate());
      records.push_back({{i / 100, i % 100}, i % 100, i % 100 + 1, p, p + GridPoint(4, 2, 0), 1.0f, 3});
    }
    return records;
  }
  Chunks table() { return {spool, kMostSegments, 32}; }

  // Where the chunks lie, after a check that they hold each segment once.
  static std::vector<std::pair<MortonKey, int>> placesOf(Chunks& chunks, std::size_t segments) {
    std::vector<std::pair<MortonKey, int>> places;
    std::set<std::uint64_t> seen;
    for (Chunk& chunk : chunks.all()) {
      places.emplace_back(chunk.key.low, chunk.key.depth);
      SegmentChain::Reader reader(chunk.own, false);
      bool one_place = true;
      for (SegmentRecord r = SegmentChain::first(); reader.next(r);) {
        EXPECT_TRUE(chunk.key.contains(mortonKey(midpoint(r.child, r.parent))));
        EXPECT_TRUE(seen.insert(r.id.key()).second);
        one_place = chunk.seen.lo == chunk.seen.hi;
      }
      EXPECT_TRUE(chunk.own.count() <= kMostSegments || one_place);
    }
    EXPECT_EQ(seen.size(), segments);
    EXPECT_TRUE(std::is_sorted(places.begin(), places.end()));
    return places;
  }

  static constexpr std::uint64_t kMostSegments = 600;
  test::TempFolder folder;
  Spool spool{folder.path(), 4096, std::uint64_t{1} << 16};
};

TEST_F(ChunksTest, JoinedTablesAndThreadsGiveTheChunksOfOneTable) {
  const std::vector<SegmentRecord> all = segments(81, 30000);
  std::vector<std::pair<MortonKey, int>> expected;
  {
    Chunks one = table();
    for (const SegmentRecord& r : all) one.add(r);
    one.settle(1, 32, [](unsigned, std::uint64_t) {});
    expected = placesOf(one, all.size());
  }
  EXPECT_GT(expected.size(), 30u);
  for (const unsigned tables : {1u, 2u, 5u})
    for (const unsigned threads : {1u, 3u}) {
      SCOPED_TRACE(std::to_string(tables) + " tables, " + std::to_string(threads) + " threads");
      Chunks whole = table();
      for (unsigned t = 0; t < tables; ++t) {
        Chunks part = table();
        for (std::size_t i = t * all.size() / tables; i < (t + 1) * all.size() / tables; ++i) part.add(all[i]);
        whole.take(part);
        EXPECT_EQ(part.size(), 1u);
      }
      whole.settle(threads, 32, [](unsigned, std::uint64_t) {});
      EXPECT_EQ(placesOf(whole, all.size()), expected);
    }
}

TEST_F(ChunksTest, AnExceptionOfAnyThreadEndsTheWork) {
  for (const unsigned thrower : {0u, 1u}) {
    Chunks whole = table();
    for (const SegmentRecord& r : segments(82, 30000)) whole.add(r);
    std::atomic<unsigned> calls{0};
    EXPECT_THROW(whole.settle(2, 32,
                              [&](unsigned worker, std::uint64_t) {
                                ++calls;
                                if (worker == thrower || calls > 200) throw std::runtime_error("enough");
                              }),
                 std::runtime_error);
  }
}

}  // namespace
}  // namespace filiform::internal
