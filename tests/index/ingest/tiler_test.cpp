#include "index/ingest/internal/tiler.h"

#include "index/errors.h"
#include "index/set/internal/cells_file.h"
#include "tests/support/sanitized.h"
#include "tests/support/scenes/grid_cells.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/temp_folder.h"

#include <bit>
#include <cmath>
#include <map>
#include <mutex>

#include <gtest/gtest.h>

namespace filiform::internal {
namespace {

using test::TempFolder;

class Collected final : public TileSink {
 public:
  void add(unsigned, LeafContent& content) override {
    const std::lock_guard lock(mutex_);
    EXPECT_FALSE(content.segments.empty());
    EXPECT_TRUE(leaves.emplace(content.leaf, std::move(content)).second);
  }
  std::map<std::uint32_t, LeafContent> leaves;

 private:
  std::mutex mutex_;
};

std::uint32_t bits(float f) { return std::bit_cast<std::uint32_t>(f); }

// Compares with tiles made by holding and sorting everything.
void expectSameAsReference(const std::vector<Cell>& cells, TilerOptions options) {
  CellList again(cells);
  const GridCells reference(again, options.grid, nullptr);
  const Placement placement = place(reference, options.capacity, nullptr);
  const auto owning = owningTiles(reference, placement);

  CellList stream(cells);
  Tiler tiler(options);
  tiler.read(stream);
  tiler.cut();
  Collected sink;
  tiler.tiles(sink);
  ASSERT_EQ(sink.leaves.size(), placement.tile_count());
  std::vector<TileId> tile_of(tiler.leaves().size() + 1, kNoTile);
  TileId t = 0;
  for (const auto& [leaf, found] : sink.leaves) {
    ASSERT_EQ(found.is_long, placement.isLong(t));
    ASSERT_TRUE(found.key == placement.key(t));
    ASSERT_EQ(found.segments.size(), placement.begin[t + 1] - placement.begin[t]);
    const TileAppearance look = buildAppearance(reference, placement, t);
    std::size_t owned = 0;
    for (std::size_t i = 0; i < found.segments.size(); ++i) {
      const Placement::Stored& stored = placement.stored[placement.begin[t] + i];
      const StoredSegment expected = reference.segment(stored.sample, reference.cellOf(stored.sample), stored.owned());
      const StoredSegment& s = found.segments[i];
      ASSERT_TRUE(s.id == expected.id && s.child_sample == expected.child_sample &&
                  s.parent_sample == expected.parent_sample && s.child == expected.child &&
                  s.parent == expected.parent && s.owned == expected.owned)
          << "tile " << t << ", segment " << i;
      if (!s.owned) continue;
      ASSERT_EQ(bits(found.appearance.radii_um.at(owned)), bits(look.radii_um.at(owned)));
      ASSERT_EQ(found.appearance.types.at(owned), look.types.at(owned));
      ++owned;
    }
    ASSERT_EQ(found.appearance.types.size(), owned);
    tile_of[leaf] = t++;
  }
  ASSERT_EQ(tiler.records().size(), cells.size());
  std::uint32_t c = 0;
  tiler.details(tile_of, [&](ByteSpan bytes) {
    CellDetail expected = reference.detail(c);
    expected.tiles = owning[c];
    ASSERT_EQ(Bytes(bytes.begin(), bytes.end()), encodeDetail(expected)) << "cell " << c;
    const CellRecord &found = tiler.records()[c], &record = reference.records()[c];
    ASSERT_TRUE(found.name == record.name && found.source == record.source && found.samples == record.samples &&
                found.segments == record.segments && found.isolated == record.isolated && found.roots == record.roots);
    ASSERT_TRUE(found.bounds.empty() == record.bounds.empty() &&
                (found.bounds.empty() || (found.bounds.lo == record.bounds.lo && found.bounds.hi == record.bounds.hi)));
    ++c;
  });
  ASSERT_EQ(c, cells.size());
}

TEST(Tiler, FindsWhatHoldingEverythingFinds) {
  std::vector<test::NamedCells> all = test::worstCases();
  all.push_back({"column", test::randomColumn(51, 8, 400, 200)});
  for (const test::NamedCells& named : all) {
    std::size_t samples = 0;
    for (const Cell& cell : named.cells) samples += cell.samples();
    for (const std::uint32_t capacity : {2u, 30u})
      for (const std::uint64_t chunk : {0u, 3u, 100u})
        for (const unsigned threads : {1u, 3u}) {
          if (threads > 1 && chunk != 100) continue;
          if (chunk == 3 && samples > 3000) continue;  // thousands of chunks, without a new case
          if (test::kSanitized && samples > 500 && (chunk == 3 || capacity == 2)) continue;
          SCOPED_TRACE(named.name + ", capacity " + std::to_string(capacity) + ", chunks of " + std::to_string(chunk));
          const TempFolder folder;
          TilerOptions options{.grid = Grid(), .capacity = capacity, .chunk_segments = chunk, .threads = threads};
          if (chunk != 0) options.folder = folder.path();
          expectSameAsReference(named.cells, options);
          if (HasFatalFailure()) return;
        }
  }
}

TEST(Tiler, KeepsSmallScenesOffTheDisk) {
  CellList stream(test::randomColumn(52, 4, 1000, 100));
  const TempFolder folder;
  Tiler tiler({.grid = Grid(), .capacity = 64, .memory = std::uint64_t{64} << 20, .folder = folder.path()});
  tiler.read(stream);
  tiler.cut();
  Collected sink;
  tiler.tiles(sink);
  EXPECT_EQ(tiler.spool_file_bytes(), 0u);
  EXPECT_EQ(tiler.chunks(), 1u);
}

// The outlier gets its own chunks; the others are cut as without it.
TEST(Tiler, AnOutlierCostsAFewChunks) {
  std::vector<Cell> cells = test::randomColumn(53, 10, 1000, 1);
  for (Cell& cell : cells)
    for (Vector3d& p_W : cell.positions_um) p_W *= 1e-3;
  test::addSample(cells[0], Vector3d(1e9, 1e9, -1e9), 0);
  CellList stream(cells);
  const TempFolder folder;
  Tiler tiler({.grid = Grid(-10), .capacity = 16, .chunk_segments = 500, .folder = folder.path()});
  tiler.read(stream);
  // About 110 halvings lead to the other cells, in each of the eight octants that meet there.
  EXPECT_LT(tiler.chunks(), 1000u);
  EXPECT_GT(tiler.spool_file_bytes(), 0u);
}

// All segments of a comb along an axis lie on faces of blocks, some far larger than the comb. Finding a segment's
// leaves must cost no more than the path down to them, whatever the number of chunks.
TEST(Tiler, SegmentsOnFacesOfCellsCostAsMuchInManyChunksAsInFew) {
  for (const std::size_t twigs : {2000u, 8000u})
    for (const std::uint64_t chunk : {std::uint64_t{1} << 20, std::uint64_t{1000}, std::uint64_t{100}}) {
      SCOPED_TRACE(std::to_string(twigs) + " twigs, chunks of " + std::to_string(chunk));
      Cell comb;
      test::addSample(comb, Vector3d::Zero(), kNoParent);
      for (std::uint32_t i = 1, spine = 0; i <= twigs; ++i) {
        test::addSample(comb, Vector3d(i, 0, 0), spine);
        spine = static_cast<std::uint32_t>(comb.samples()) - 1;
        test::addSample(comb, Vector3d(i, 3, 0), spine);
      }
      CellList stream({comb});
      const TempFolder folder;
      Tiler tiler({.grid = Grid(), .capacity = 16, .chunk_segments = chunk, .folder = folder.path()});
      tiler.read(stream);
      tiler.cut();
      Collected sink;
      tiler.tiles(sink);
      const std::uint64_t segments = 2 * twigs, halvings = 3 * 10;  // to 8 um in one of 8 mm
      EXPECT_GT(tiler.visited(), segments);
      // Once to find its chunks, and once in each of them, at most four.
      EXPECT_LT(tiler.visited(), 5 * (halvings + 8) * segments);
    }
}

// Stars at one position: many times more ghosts than owned segments. The memory holds neither a chunk nor the content
// of its leaves.
TEST(Tiler, GhostsAreBuiltInPartsWhereMemoryIsShort) {
  std::vector<Cell> stars(test::kSanitized ? 10 : 40);
  for (std::size_t c = 0; c < stars.size(); ++c) {
    const double shift = 0.1 * static_cast<double>(c);
    stars[c].source = "star" + std::to_string(c);
    const std::uint32_t root = test::addSample(stars[c], Vector3d(shift, 0.7 * shift, -shift), kNoParent);
    for (int i = 0; i < 100; ++i)
      test::addSample(stars[c], 100 * Vector3d(std::sin(i), std::cos(i), std::sin(7 * i)).normalized(), root);
  }
  for (const std::uint32_t capacity : {64u, 200u})
    for (const unsigned threads : {1u, 3u}) {
      SCOPED_TRACE(std::to_string(capacity) + ", " + std::to_string(threads) + " threads");
      const TempFolder folder;
      TilerOptions options{.grid = Grid(), .capacity = capacity, .memory = std::uint64_t{4} << 20, .threads = threads};
      options.folder = folder.path();
      expectSameAsReference(stars, options);
      if (HasFatalFailure()) return;
    }
}

// More chunks than open buffers.
TEST(Tiler, ChunksBeyondTheOpenOnesAreSplitLater) {
  const std::vector<Cell> cells = test::randomColumn(54, 8, 600, 200);
  for (const unsigned threads : {1u, 3u}) {
    const TempFolder folder;
    TilerOptions options{
        .grid = Grid(), .capacity = 20, .memory = std::uint64_t{3} << 20, .chunk_segments = 40, .threads = threads};
    options.folder = folder.path();
    expectSameAsReference(cells, options);
    if (HasFatalFailure()) return;
  }
}

TEST(Tiler, RefusesATileThatDoesNotFitTheMemory) {
  CellList stream({test::coincidentNodes(250000)});
  Tiler tiler({.grid = Grid(), .capacity = 16, .memory = std::uint64_t{64} << 20});
  EXPECT_THROW(tiler.read(stream), InputError);
}

// The refusal comes before each chunk gets its ghosts: a fraction of the walks through the partition.
TEST(Tiler, RefusesACrowdedLeafAfterASmallPartOfTheWork) {
  std::vector<Cell> stars(30);
  for (std::size_t c = 0; c < stars.size(); ++c) {
    const double shift = 0.1 * static_cast<double>(c);
    stars[c].source = "star" + std::to_string(c);
    const Vector3d centre(1000 + shift, 1000, 1000);
    const std::uint32_t root = test::addSample(stars[c], centre, kNoParent);
    for (int i = 0; i < 200; ++i)
      test::addSample(stars[c], centre + 100 * Vector3d(std::sin(i), std::cos(i), std::sin(7 * i)).normalized(), root);
  }
  const auto run = [&](std::uint64_t memory, std::string& refusal) {
    CellList stream(stars);
    const TempFolder folder;
    Tiler tiler({.grid = Grid(), .capacity = 100, .memory = memory, .chunk_segments = 300, .folder = folder.path()});
    tiler.read(stream);
    try {
      tiler.cut();
    } catch (const InputError& e) {
      refusal = e.what();
      return tiler.visited();
    }
    Collected sink;
    tiler.tiles(sink);
    return tiler.visited();
  };
  std::string refusal;
  const std::uint64_t whole = run(std::uint64_t{64} << 20, refusal);
  EXPECT_EQ(refusal, "");
  const std::uint64_t part = run(std::uint64_t{1} << 20, refusal);
  EXPECT_NE(refusal.find("one tile stores "), std::string::npos) << refusal;
  EXPECT_LT(part, whole / 4) << part << " of " << whole;
}

TEST(Tiler, ACellOfLinksKeepsItsLoops) {
  Cell loop;
  loop.source = "loop";
  for (int i = 0; i < 6; ++i) {
    loop.sample_ids.push_back(i);
    loop.positions_um.emplace_back(10 * std::cos(i), 10 * std::sin(i), i);
    loop.radii_um.push_back(0.1f * static_cast<float>(i));
    loop.types.push_back(static_cast<std::uint16_t>(i));
  }
  loop.links = {{1, 0}, {2, 1}, {3, 2}, {3, 0}, {4, 3}, {4, 3}, {5, 5}};
  CellList stream({loop});
  Tiler tiler({.grid = Grid(), .capacity = 100});
  tiler.read(stream);
  tiler.cut();
  Collected sink;
  tiler.tiles(sink);
  ASSERT_EQ(sink.leaves.size(), 1u);
  const LeafContent& leaf = sink.leaves.begin()->second;
  ASSERT_EQ(leaf.segments.size(), loop.links.size());
  for (std::uint32_t i = 0; i < loop.links.size(); ++i) {
    EXPECT_EQ(leaf.segments[i].id, (SegmentId{0, i}));
    EXPECT_EQ(leaf.segments[i].child_sample, loop.links[i][0]);
    EXPECT_EQ(leaf.segments[i].parent_sample, loop.links[i][1]);
    EXPECT_EQ(leaf.appearance.types[i], loop.links[i][0]);
  }
  EXPECT_EQ(tiler.records()[0].segments, 6u);
  EXPECT_EQ(tiler.records()[0].isolated, 1u);
  EXPECT_EQ(tiler.records()[0].roots, 2u);
}

}  // namespace
}  // namespace filiform::internal
