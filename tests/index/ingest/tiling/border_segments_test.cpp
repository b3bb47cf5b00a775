#include "index/ingest/tiling/internal/border_segments.h"

#include "tests/support/temp_folder.h"

#include <algorithm>
#include <optional>
#include <random>
#include <set>

#include <gtest/gtest.h>

namespace filiform::internal {
namespace {

using Ghosts = std::vector<std::vector<std::uint64_t>>;  // ids by chunk, ascending

struct BorderSegmentsTest : ::testing::Test {
  static constexpr std::uint64_t kSeed = 71;
  static constexpr std::uint32_t kSegments = 20000, kCapacity = 1;

  // Some lie in one leaf, some cross chunks, some more leaves than a segment may.
  static std::vector<SegmentRecord> segments() {
    std::mt19937_64 random(kSeed);
    std::vector<SegmentRecord> records;
    for (std::uint32_t i = 0; i < kSegments; ++i) {
      const auto coordinate = [&](std::int64_t extent) {
        return static_cast<std::int64_t>(random() % (2 * extent)) - extent;
      };
      const std::int64_t length = i % 3 == 0 ? 2000 : 20;
      const GridPoint a(coordinate(1 << 13), coordinate(1 << 13), coordinate(1 << 13));
      GridPoint b = a + GridPoint(coordinate(length), coordinate(length), coordinate(length));
      if (i % 1000 == 0) b = -a.cwiseSign() * (1 << 13);
      records.push_back({{i / 100, i % 100}, i % 100, i % 100 + 1, a, b, 1.0f, 3});
    }
    return records;
  }

  void fill(const std::vector<SegmentRecord>& all) {
    table.emplace(spool, 400, 32);
    for (const SegmentRecord& r : all) table->add(r);
    table->settle(1, 32, [](unsigned, std::uint64_t) {});
  }

  void cut(std::span<SegmentChain> crossing) {
    LandmarkSurvey survey;
    CutWork work;
    std::vector<BlockKey> leaves;
    for (std::size_t i = 0; i < table->all().size(); ++i) {
      Chunk& chunk = table->all()[i];
      chunk.first_leaf = static_cast<std::uint32_t>(leaves.size());
      const CutLeaves found = cutChunk(chunk, kCapacity, survey, crossing[i % crossing.size()], work);
      leaves.insert(leaves.end(), found.keys.begin(), found.keys.end());
      chunk.end_leaf = static_cast<std::uint32_t>(leaves.size());
    }
    for (SegmentChain& chain : crossing) chain.close();
    partition = Partition(std::move(leaves));
  }

  Ghosts ghosts() {
    Ghosts ghosts;
    for (Chunk& chunk : table->all()) {
      std::vector<std::uint64_t>& ids = ghosts.emplace_back();
      SegmentChain::Reader reader(chunk.ghosts, false);
      for (SegmentRecord r = SegmentChain::first(); reader.next(r);) ids.push_back(r.id.key());
      std::sort(ids.begin(), ids.end());
      EXPECT_EQ(std::adjacent_find(ids.begin(), ids.end()), ids.end());
    }
    return ghosts;
  }

  test::TempFolder folder;
  Spool spool{folder.path(), 4096, std::uint64_t{1} << 18};
  std::optional<Chunks> table;
  Partition partition{std::vector<BlockKey>{BlockKey{}}};
};

TEST_F(BorderSegmentsTest, EachChunkGetsWhatItsLeavesStore) {
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  const std::vector<SegmentRecord> all = segments();
  Ghosts first;
  for (const unsigned threads : {1u, 1u, 3u, 3u, 16u}) {
    const std::size_t most_open = first.empty() || threads == 3 ? 1000 : 10;
    SCOPED_TRACE(std::to_string(threads) + " threads, " + std::to_string(most_open) + " open");
    fill(all);
    std::vector<SegmentChain> crossing;
    for (unsigned i = 0; i < threads; ++i) crossing.emplace_back(spool);
    cut(crossing);
    BorderSegments border(*table, partition, spool, {most_open, threads, [](unsigned, std::uint64_t) {}});
    border.deliver(crossing);
    EXPECT_GT(border.visited(), 0u);
    const Ghosts found = ghosts();
    if (!first.empty()) {
      EXPECT_EQ(found, first);
      continue;
    }
    first = found;
    EXPECT_GT(found.size(), 50u);
    std::size_t long_segments = 0, stored = 0;
    std::vector<std::uint32_t> met;
    for (const SegmentRecord& r : all) {
      const bool few = partition.leavesMet(r.child, r.parent, met);
      if (!few) met = {partition.home(r.child), partition.home(r.parent)}, ++long_segments;
      const std::size_t own = table->ofLeaf(partition.home(midpoint(r.child, r.parent)));
      std::set<std::size_t> expected;
      for (const std::uint32_t leaf : met) expected.insert(table->ofLeaf(leaf));
      expected.erase(own);
      for (std::size_t c = 0; c < found.size(); ++c) {
        const bool is_there = std::binary_search(found[c].begin(), found[c].end(), r.id.key());
        stored += is_there;
        if (few || expected.contains(c)) {
          EXPECT_EQ(is_there, expected.contains(c)) << "chunk " << c;
        }
      }
    }
    EXPECT_GT(long_segments, 0u);
    EXPECT_GT(stored, all.size() / 10);
  }
}

TEST_F(BorderSegmentsTest, AnExceptionOfAnyThreadEndsTheWork) {
  std::vector<SegmentRecord> all;
  for (int i = 0; i < 12; ++i)
    for (const SegmentRecord& r : segments()) all.push_back(r);
  fill(all);
  std::vector<SegmentChain> crossing;
  crossing.emplace_back(spool);
  cut(crossing);
  ASSERT_GT(crossing[0].count(), 65536u);
  BorderSegments border(*table, partition, spool,
                        {1000, 2, [](unsigned, std::uint64_t) { throw std::runtime_error("stopped"); }});
  EXPECT_THROW(border.deliver(crossing), std::runtime_error);
}

}  // namespace
}  // namespace filiform::internal
