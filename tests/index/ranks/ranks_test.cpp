#include "index/ranks/ranks.h"

#include "index/errors.h"
#include "index/ingest/ingest.h"
#include "index/verify/verify.h"
#include "tests/support/sanitized.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/scenes/thread_ranks.h"
#include "tests/support/temp_folder.h"

#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::onRanks;
using test::TempFolder;

// A consecutive part of the cells.
std::vector<Cell> partOf(const std::vector<Cell>& cells, const Ranks& ranks) {
  const auto at = [&](unsigned rank) {
    return cells.begin() + static_cast<std::ptrdiff_t>(cells.size() * rank / ranks.count());
  };
  return {at(ranks.rank()), at(ranks.rank() + 1)};
}

std::string ingestOnRanks(unsigned count, const std::vector<Cell>& cells, const std::string& path,
                          IngestOptions options) {
  std::string revision;
  const auto thrown = onRanks(count, [&](Ranks& ranks) {
    IngestOptions own = options;
    own.ranks = &ranks;
    CellList part(partOf(cells, ranks));
    const IngestResult result = ingest(part, path, own);
    if (ranks.rank() == 0) revision = result.revision;
  });
  for (const std::exception_ptr& error : thrown)
    if (error) std::rethrow_exception(error);
  return revision;
}

TEST(IngestOnRanks, GivesTheSameBytesForAnyNumberOfRanks) {
  std::vector<test::NamedCells> all = test::worstCases();
  all.push_back({"column", test::randomColumn(33, 6, 300, 120)});
  for (const test::NamedCells& named : all) {
    SCOPED_TRACE(named.name);
    const TempFolder folder;
    for (const std::uint64_t pack : {std::uint64_t{3000}, std::uint64_t{1} << 28}) {
      const IngestOptions plain{.capacity = 20, .threads = 1, .pack_bytes = pack, .levels = pack > 3000, .force = true};
      CellList stream(named.cells);
      const IngestResult one = ingest(stream, folder / "a.fil", plain);
      for (const unsigned ranks : {1u, 2u, 3u, 5u})
        for (const std::uint64_t chunk : {20u, 150u}) {
          if (test::kSanitized && (chunk == 150 || ranks == 3)) continue;
          IngestOptions options = plain;
          options.threads = 2;
          options.chunk_segments = chunk;
          EXPECT_EQ(ingestOnRanks(ranks, named.cells, folder / "b.fil", options), one.revision)
              << ranks << " ranks, chunks of " << chunk;
        }
    }
    const VerifyReport report = verify(folder / "b.fil", {.deep = true});
    EXPECT_TRUE(report.sound()) << report.problems.front();
  }
}

TEST(IngestOnRanks, AFailureOfOneRankEndsAllAndKeepsTheOldSet) {
  const std::vector<Cell> cells = test::randomColumn(34, 6, 300, 120);
  const TempFolder folder;
  CellList stream(cells);
  const IngestResult old = ingest(stream, folder / "a.fil", {.capacity = 50});
  for (unsigned failing = 0; failing < 3; ++failing)
    for (const std::string where : {"reading", "exchanging segments", "cutting", "writing tiles", "writing cells"}) {
      const auto thrown = onRanks(3, [&](Ranks& ranks) {
        IngestOptions options{.capacity = 20, .threads = 1, .chunk_segments = 50, .force = true};
        options.ranks = &ranks;
        options.progress = [&](const char* phase, std::uint64_t, std::uint64_t) {
          if (ranks.rank() == failing && where == phase) throw InputError("this rank fails");
        };
        CellList part(partOf(cells, ranks));
        ingest(part, folder / "a.fil", options);
      });
      if (where == "writing cells" && failing != 0) {
        for (const std::exception_ptr& error : thrown) EXPECT_FALSE(error);
        CellList again(cells);
        ingest(again, folder / "a.fil", {.capacity = 50, .force = true});
        continue;  // the work of rank 0
      }
      for (unsigned rank = 0; rank < 3; ++rank) {
        ASSERT_TRUE(thrown[rank]) << where << " on rank " << failing << ", rank " << rank;
        try {
          std::rethrow_exception(thrown[rank]);
        } catch (const RankFailed& error) {
          EXPECT_NE(rank, failing);
          EXPECT_EQ(error.rank(), failing);
          EXPECT_STREQ(error.what(), ("rank " + std::to_string(failing) + ": this rank fails").c_str());
        } catch (const InputError&) {
          EXPECT_EQ(rank, failing);
        }
      }
      EXPECT_EQ(TileSet::open(folder / "a.fil")->revision(), old.revision);
      EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder / "a.fil"), {}), 2) << "something remains";
    }
}

}  // namespace
}  // namespace filiform
