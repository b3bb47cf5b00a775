#include "index/query/segment_pass.h"

#include "index/errors.h"
#include "index/ingest/ingest.h"
#include "index/set/tile_set.h"
#include "tests/support/scenes/counting_store.h"
#include "tests/support/scenes/memory_store.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/scenes/slow_folder.h"
#include "tests/support/temp_folder.h"

#include <map>
#include <random>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::storeOf;

struct Seen {
  std::map<std::uint64_t, PassedSegment> segments;  // by id
  std::vector<TileId> tiles;
};

Seen passed(const TileStore& store, const SegmentPass& pass = {}) {
  Seen seen;
  forEachSegment(store, pass, [&](TileId tile, std::span<const PassedSegment> segments) {
    EXPECT_FALSE(segments.empty());
    seen.tiles.push_back(tile);
    for (const PassedSegment& s : segments) EXPECT_TRUE(seen.segments.emplace(s.id.key(), s).second) << "twice";
  });
  return seen;
}

TEST(SegmentPass, VisitsEachSegmentOnceAndDecodesEachTileOnce) {
  std::vector<test::NamedCells> all = test::worstCases();
  all.push_back({"column", test::randomColumn(71, 6, 300, 100)});
  for (const test::NamedCells& named : all) {
    SCOPED_TRACE(named.name);
    const auto store = storeOf(named.cells, 30);
    const test::CountingStore counting(*store);
    const Seen seen = passed(counting, {.with_appearance = true});
    EXPECT_EQ(counting.loads().size(), store->tile_count());
    EXPECT_TRUE(std::is_sorted(seen.tiles.begin(), seen.tiles.end()));
    std::size_t expected = 0;
    for (std::uint32_t c = 0; c < named.cells.size(); ++c) {
      const Cell& cell = named.cells[c];
      expected += store->cell(c).segments + store->cell(c).isolated;
      for (std::uint32_t i = 0; !cell.links.size() && i < cell.samples(); ++i) {
        if (cell.parents[i] == kNoParent) continue;
        const auto at = seen.segments.find(SegmentId{c, i}.key());
        ASSERT_NE(at, seen.segments.end());
        const PassedSegment& s = at->second;
        EXPECT_EQ(s.child_sample, i);
        EXPECT_EQ(s.parent_sample, cell.parents[i]);
        EXPECT_EQ(s.child, store->grid().snap(cell.positions_um[i]));
        EXPECT_EQ(s.parent, store->grid().snap(cell.positions_um[cell.parents[i]]));
        EXPECT_EQ(s.type, cell.types[i]);
      }
    }
    EXPECT_EQ(seen.segments.size(), expected);
  }
}

TEST(SegmentReader, GivesTileByTileWhatThePassVisits) {
  const auto store = storeOf(test::randomColumn(71, 6, 300, 100), 30);
  const GridBox box{store->grid().snap({-100, -100, -100}), store->grid().snap({50, 50, 50})};
  for (const SegmentPass& pass : {SegmentPass{}, SegmentPass{.box = box}, SegmentPass{.cells = {{1, 4}}}}) {
    SegmentReader reader(*store, pass);
    forEachSegment(*store, pass, [&](TileId tile, std::span<const PassedSegment> segments) {
      const std::span<const PassedSegment> read = reader.next();
      EXPECT_EQ(reader.tile(), tile);
      ASSERT_EQ(read.size(), segments.size());
      for (std::size_t i = 0; i < read.size(); ++i) EXPECT_EQ(read[i].id, segments[i].id);
    });
    EXPECT_TRUE(reader.next().empty());
    EXPECT_TRUE(reader.next().empty());
  }
}

TEST(SegmentPass, BoxesAndCellsChooseAsBruteForceDoes) {
  const std::uint64_t seed = 72;
  SCOPED_TRACE(seed);
  std::mt19937_64 random(seed);
  std::vector<test::NamedCells> all = test::worstCases();
  all.push_back({"column", test::randomColumn(73, 6, 300, 100)});
  for (const test::NamedCells& named : all) {
    SCOPED_TRACE(named.name);
    const auto store = storeOf(named.cells, 30);
    const Seen whole = passed(*store);
    if (whole.segments.empty()) continue;
    for (int round = 0; round < 40; ++round) {
      auto at = whole.segments.begin();
      std::advance(at, static_cast<std::ptrdiff_t>(random() % whole.segments.size()));
      SegmentPass pass;
      const auto reach = static_cast<std::int64_t>(random() % 8000);
      pass.box = GridBox{at->second.child.array() - reach, at->second.child.array() + reach};
      if (round % 2 == 1) {
        pass.cells.emplace();
        for (std::uint32_t c = 0; c < store->cell_count(); ++c)
          if (random() % 2 == 0) pass.cells->push_back(c);
      }
      const Seen seen = passed(*store, pass);
      std::size_t expected = 0;
      for (const auto& [key, s] : whole.segments) {
        const bool wanted = segmentMeetsBox(s.child, s.parent, *pass.box) &&
                            (!pass.cells || std::count(pass.cells->begin(), pass.cells->end(), s.id.cell) > 0);
        expected += wanted;
        EXPECT_EQ(seen.segments.contains(key), wanted);
      }
      EXPECT_EQ(seen.segments.size(), expected);
    }
  }
}

TEST(SegmentPass, ThreadsAndAddressesChangeNothingAndAnAddressReadsTogether) {
  const test::TempFolder folder;
  CellList cells(test::randomColumn(74, 4, 500, 200));
  ingest(cells, folder / "a.fil", {.capacity = 64});
  const Seen expected = passed(*TileSet::open(folder / "a.fil"), {.with_appearance = true});
  for (const unsigned threads : {1u, 3u})
    for (const bool remote : {false, true}) {
      auto source = std::make_unique<test::SlowFolder>(folder / "a.fil", remote);
      const test::SlowFolder& slow = *source;
      const auto set = TileSet::open(std::move(source));
      const Seen seen = passed(*set, {.with_appearance = true, .threads = threads});
      EXPECT_EQ(seen.tiles, expected.tiles);
      EXPECT_EQ(seen.segments.size(), expected.segments.size());
      EXPECT_EQ(slow.reads, 2 * static_cast<int>(set->tile_count()));
      if (remote) {
        EXPECT_GT(slow.most_under_way, 8);
      }
    }
}

TEST(SegmentPass, AnExceptionOfTheCheckEndsThePass) {
  const auto store = storeOf(test::randomColumn(75, 2, 300, 80), 32);
  int tiles = 0;
  SegmentPass pass;
  pass.check = [&] {
    if (tiles == 3) throw Interrupted("enough");
  };
  EXPECT_THROW(forEachSegment(*store, pass, [&](TileId, std::span<const PassedSegment>) { ++tiles; }), Interrupted);
  EXPECT_EQ(tiles, 3);
}

}  // namespace
}  // namespace filiform
