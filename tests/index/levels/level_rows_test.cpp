#include "index/levels/level_rows.h"

#include "index/errors.h"
#include "index/ingest/ingest.h"
#include "index/query/segment_pass.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/temp_folder.h"

#include <limits>
#include <set>
#include <tuple>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using Ends = std::tuple<double, double, double, double, double, double, std::uint32_t>;

Ends endsOf(const Vector3d& a, const Vector3d& b, std::uint32_t cell) {
  return {a.x(), a.y(), a.z(), b.x(), b.y(), b.z(), cell};
}

TEST(LevelRows, FewPixelsNeedFewSegmentsAndManyPixelsNeedThemAll) {
  const test::TempFolder folder;
  CellList stream(test::randomColumn(31, 12, 500, 300));
  ingest(stream, folder / "a.fil", {.capacity = 8, .levels = true});
  const auto set = TileSet::open(folder / "a.fil");
  const auto levels = Levels::open(*set);
  ASSERT_NE(levels, nullptr);
  const Grid grid = set->grid();
  int checks = 0;
  LevelBox box{
      .lo_W = grid.toWorld(set->bounds().lo), .hi_W = grid.toWorld(set->bounds().hi), .pixels = 100, .check = [&] {
        ++checks;
      }};
  const LevelRows coarse = levelRows(*set, *levels, box);
  EXPECT_GT(checks, 0);
  EXPECT_GT(coarse.rows.size(), 0u);
  EXPECT_LT(coarse.rows.size(), set->counts().segments);
  EXPECT_LE(coarse.error_um, (box.hi_W - box.lo_W).maxCoeff() / box.pixels);
  EXPECT_FALSE(coarse.limited);

  box.pixels = 1e9;
  const LevelRows fine = levelRows(*set, *levels, box);
  std::multiset<Ends> expected, found;
  forEachSegment(*set, {}, [&](TileId, std::span<const PassedSegment> segments) {
    for (const PassedSegment& s : segments)
      expected.insert(endsOf(grid.toWorld(s.child), grid.toWorld(s.parent), s.id.cell));
  });
  for (const LevelRow& row : fine.rows) found.insert(endsOf(row.child_W, row.parent_W, row.cell));
  EXPECT_EQ(found, expected);
  EXPECT_EQ(fine.hidden, 0u);

  box.most_segments = 1;
  EXPECT_TRUE(levelRows(*set, *levels, box).limited);
  for (const double pixels : {0.0, -1.0, std::numeric_limits<double>::infinity()}) {
    box.pixels = pixels;
    EXPECT_THROW(levelRows(*set, *levels, box), UsageError);
  }
  box.pixels = 100;
  box.hi_W = box.lo_W;
  EXPECT_THROW(levelRows(*set, *levels, box), UsageError);
}

}  // namespace
}  // namespace filiform
