#include "index/file/internal/spool.h"

#include "index/errors.h"
#include "index/tile/internal/segment_chain.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/scenes/tile_invariants.h"
#include "tests/support/temp_folder.h"

#include <csignal>
#include <filesystem>
#include <random>
#include <set>
#include <sys/resource.h>
#include <vector>

#include <gtest/gtest.h>

namespace filiform::internal {
namespace {

using test::TempFolder;

Bytes randomBytes(std::uint64_t seed, std::size_t n) {
  std::mt19937_64 random(seed);
  Bytes bytes(n);
  for (std::uint8_t& b : bytes) b = static_cast<std::uint8_t>(random());
  return bytes;
}

TEST(Spool, ReadersOneAfterTheOtherShareABuffer) {
  const TempFolder folder;
  Spool spool(folder.path(), 512, 0);
  std::vector<ByteChain> chains;
  for (int i = 0; i < 50; ++i) {
    ByteChain& chain = chains.emplace_back(spool);
    chain.append(randomBytes(1, 400));
    chain.close();
  }
  std::set<const std::uint8_t*> buffers;
  for (ByteChain& chain : chains) buffers.insert(ByteChain::Reader(chain, true).next().data());
  EXPECT_LE(buffers.size(), 2U) << "memory would grow with the number of chains";
}

TEST(Spool, ChainsGiveBackWhatWasAppended) {
  const TempFolder folder;
  for (const std::uint64_t memory : {0u, 5 * 512u, 1u << 20}) {
    SCOPED_TRACE(memory);
    Spool spool(folder.path(), 512, memory);
    std::vector<ByteChain> chains;
    std::vector<Bytes> expected(5);
    for (std::size_t i = 0; i < expected.size(); ++i) chains.emplace_back(spool);
    std::mt19937_64 random(1);
    for (int i = 0; i < 200; ++i) {
      const std::size_t c = random() % expected.size();
      const Bytes some = randomBytes(random(), random() % 700);
      chains[c].append(some);
      expected[c].insert(expected[c].end(), some.begin(), some.end());
    }
    EXPECT_TRUE(std::filesystem::is_empty(folder.path())) << "the file keeps its name";
    EXPECT_EQ(spool.file_bytes() > 0, memory < 100000);
    Spool::Buffer scratch;
    for (std::size_t c = 0; c < chains.size(); ++c) {
      chains[c].close();
      ASSERT_EQ(chains[c].bytes(), expected[c].size());
      for (int i = 0; i < 20; ++i) {
        const std::size_t from = random() % expected[c].size(), n = random() % (expected[c].size() - from);
        Bytes part(n);
        chains[c].read(from, part, scratch);
        ASSERT_TRUE(std::equal(part.begin(), part.end(), expected[c].begin() + static_cast<std::ptrdiff_t>(from)));
      }
      Bytes all;
      {
        ByteChain::Reader reader(chains[c], c % 2 == 0);
        for (ByteSpan block; !(block = reader.next()).empty();) all.insert(all.end(), block.begin(), block.end());
      }
      EXPECT_EQ(all, expected[c]);
      EXPECT_EQ(chains[c].bytes(), c % 2 == 0 ? 0 : expected[c].size());
    }
  }
}

TEST(Spool, ReleasedBlocksAreUsedAgain) {
  const TempFolder folder;
  Spool spool(folder.path(), 1024, 0);
  std::uint64_t after_first = 0;
  for (int round = 0; round < 10; ++round) {
    ByteChain chain(spool);
    const Bytes bytes = randomBytes(static_cast<std::uint64_t>(round), 50000);
    chain.append(bytes);
    chain.close();
    Bytes back(bytes.size());
    ByteChain::Reader(chain, true).read(back.data(), back.size());
    ASSERT_EQ(back, bytes);
    if (round == 0) after_first = spool.file_bytes();
  }
  EXPECT_EQ(spool.file_bytes(), after_first);
}

TEST(Spool, AChainMovesFromMemoryToTheFile) {
  const TempFolder folder;
  Spool spool(folder.path(), 1024, 20 * 1024);
  const Bytes bytes = randomBytes(5, 50000);
  ByteChain chain(spool);
  chain.append(bytes);
  chain.close();
  const std::uint64_t before = spool.file_bytes();
  chain.spill();
  EXPECT_EQ(spool.file_bytes(), before + 20 * 1024);
  chain.spill();
  EXPECT_EQ(spool.file_bytes(), before + 20 * 1024);
  Bytes back(bytes.size());
  ByteChain::Reader(chain, true).read(back.data(), back.size());
  EXPECT_EQ(back, bytes);
}

TEST(Spool, WithoutAFolderEverythingStaysInMemory) {
  Spool spool("", 512, 0);
  ByteChain chain(spool);
  chain.append(randomBytes(3, 100000));
  chain.close();
  EXPECT_EQ(spool.file_bytes(), 0u);
  EXPECT_EQ(chain.bytes(), 100000u);
}

TEST(Spool, AFullDiskIsSaid) {
  const TempFolder folder;
  struct rlimit before {};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  struct rlimit small = before;
  small.rlim_cur = 3000;
  Spool spool(folder.path(), 1024, 0);
  ByteChain chain(spool);
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
  EXPECT_THROW(chain.append(randomBytes(4, 10000)), IoError);
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, handler);
}

TEST(SegmentChain, GivesBackEveryRecord) {
  const TempFolder folder;
  std::vector<SegmentRecord> expected;
  const Grid grid;
  for (const test::NamedCells& named : test::worstCases())
    for (const StoredSegment& s : test::snappedSegments(named.cells, grid))
      expected.push_back({s.id, s.child_sample, s.parent_sample, s.child, s.parent,
                          s.id.segment % 5 == 0 ? kUnknownRadius : 0.25f * static_cast<float>(s.id.segment % 3),
                          static_cast<std::uint16_t>(s.id.segment / 7)});
  std::mt19937_64 random(5);
  const std::int64_t edge = std::int64_t{1} << 41;
  for (int i = 0; i < 2000; ++i) {  // in random order, as links of graphs or ghosts
    const auto word = [&] { return static_cast<std::uint32_t>(random() >> (32 + random() % 32)); };
    const auto place = [&] {
      return GridPoint(static_cast<std::int64_t>(random() % (2 * static_cast<std::uint64_t>(edge))) - edge, -edge,
                       edge - 1);
    };
    SegmentRecord r{{word(), word()},
                    word(),
                    word(),
                    place(),
                    place(),
                    static_cast<float>(word()),
                    static_cast<std::uint16_t>(random())};
    if (i % 4 == 1) r.parent_sample = expected.back().child_sample, r.parent = expected.back().child;
    if (i % 4 == 0 || r.parent_sample == r.child_sample) r.parent_sample = r.child_sample, r.parent = r.child;
    expected.push_back(r);
  }
  Spool spool(folder.path(), 4096, 3 * 4096);
  SegmentChain chain(spool);
  for (const SegmentRecord& r : expected) chain.add(r);
  chain.close();
  ASSERT_EQ(chain.count(), expected.size());
  for (const bool release : {false, true}) {
    SegmentChain::Reader reader(chain, release);
    SegmentRecord r = SegmentChain::first();
    for (const SegmentRecord& e : expected) {
      ASSERT_TRUE(reader.next(r));
      ASSERT_EQ(r.id, e.id);
      ASSERT_EQ(r.child_sample, e.child_sample);
      ASSERT_EQ(r.parent_sample, e.parent_sample);
      ASSERT_EQ(r.child, e.child);
      ASSERT_EQ(r.parent, e.parent);
      ASSERT_EQ(std::bit_cast<std::uint32_t>(r.radius_um), std::bit_cast<std::uint32_t>(e.radius_um));
      ASSERT_EQ(r.type, e.type);
    }
    ASSERT_FALSE(reader.next(r));
  }
}

}  // namespace
}  // namespace filiform::internal
