// Exact searches in a set that is far away: the same results, in fewer rounds of reads.
#include "index/ingest/ingest.h"
#include "index/query/internal/tile_cache.h"
#include "index/query/nearest.h"
#include "index/set/tile_set.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/scenes/slow_folder.h"
#include "tests/support/temp_folder.h"

#include <algorithm>
#include <memory>
#include <random>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

class NearestRemoteTest : public ::testing::Test {
 protected:
  NearestRemoteTest() {
    std::vector<Cell> column = test::randomColumn(7, 20, 500, 300);
    for (Cell& cell : column)
      for (std::size_t i = 0; i < cell.types.size(); i += 60) cell.types[i] = 7;
    CellList cells(std::move(column));
    ingest(cells, folder_ / "a.fil", {.capacity = 64, .page_tiles = 64});
    near_ = TileSet::open(folder_ / "a.fil");
    auto source = std::make_unique<test::SlowFolder>(folder_ / "a.fil", true);
    slow_ = source.get();
    far_ = TileSet::open(std::move(source));
  }
  std::vector<Vector3d> places(std::uint64_t seed, int n) const {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> place(-200, 200);
    std::vector<Vector3d> all;
    for (int i = 0; i < n; ++i) all.emplace_back(place(random), place(random), place(random));
    return all;
  }

  test::TempFolder folder_;
  const test::SlowFolder* slow_ = nullptr;  // of far_
  std::unique_ptr<TileSet> near_, far_;
};

TEST_F(NearestRemoteTest, ResultsAndTilesReadAreThoseOfTheFolder) {
  ASSERT_GT(near_->tile_count(), 100u);
  for (const std::uint64_t budget : {std::uint64_t{0}, UINT64_MAX}) {
    const NearestOptions options{.budget_bytes = budget};
    const Nearest near(*near_, options), far(*far_, options);
    for (const Vector3d& h_W : places(41, 60)) {
      const NearestQuery query{.k = 3};
      std::vector<NearestResult> a, b;
      const SearchCounts here = near.find(h_W, query, a), there = far.find(h_W, query, b);
      EXPECT_EQ(here.tiles_read, there.tiles_read) << "seed 41";
      EXPECT_EQ(here.tiles_searched, there.tiles_searched);
      ASSERT_EQ(a.size(), b.size());
      for (std::size_t i = 0; i < a.size(); ++i) {
        EXPECT_EQ(a[i].segment, b[i].segment);
        EXPECT_EQ(a[i].distance_um, b[i].distance_um);
      }
    }
  }
}

TEST_F(NearestRemoteTest, TilesThatComeNextAreReadTogether) {
  const Nearest far(*far_, {});
  for (const Vector3d& h_W : places(42, 20)) far.find(h_W, {.k = 3});
  EXPECT_GE(slow_->most_under_way, 3);
  const int all = slow_->reads;
  for (const Vector3d& h_W : places(42, 20)) far.find(h_W, {.k = 3});
  EXPECT_EQ(slow_->reads, all) << "tiles in memory are not read again, nor others beside them";
}

// The searches that need many tiles, with little and much memory for tiles: the largest number of reads under way.
class ManyTilesAtOnceTest : public NearestRemoteTest, public ::testing::WithParamInterface<std::uint64_t> {
 protected:
  template <typename Result>
  static void expectSame(const std::vector<Result>& a, const std::vector<Result>& b, const SearchCounts& here = {},
                         const SearchCounts& there = {}) {
    EXPECT_EQ(here.tiles_read, there.tiles_read);
    EXPECT_EQ(here.tiles_searched, there.tiles_searched);
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t i = 0; i < a.size(); ++i) {
      EXPECT_EQ(a[i].segment, b[i].segment);
      EXPECT_EQ(a[i].distance_um, b[i].distance_um);
      EXPECT_EQ(a[i].tile, b[i].tile);
    }
  }
  const NearestOptions options_{.budget_bytes = GetParam()};
  const Nearest nearby_{*near_, options_}, far_away_{*far_, options_};
};

TEST_P(ManyTilesAtOnceTest, Box) {
  const Vector3d corner_W = Vector3d::Constant(120);
  std::vector<NearestResult> found, expected;
  const SearchCounts counts = far_away_.inBox(-corner_W, corner_W, false, found);
  ASSERT_GT(counts.tiles_searched, 64u) << "several rounds";
  const SearchCounts here = nearby_.inBox(-corner_W, corner_W, false, expected);
  expectSame(expected, found, here, counts);
  EXPECT_GE(slow_->most_under_way, 16);
  EXPECT_LE(static_cast<std::uint32_t>(slow_->reads), counts.tiles_searched) << "no tile is read twice";
}

TEST_P(ManyTilesAtOnceTest, Ray) {
  RayQuery ray{.origin_W = Vector3d(-400, 3, 5), .direction = Vector3d(1, .1, .05), .radius_um = 20};
  std::vector<RayHit> found, expected;
  const SearchCounts counts = far_away_.alongRay(ray, found);
  ASSERT_FALSE(found.empty());
  SearchCounts here = nearby_.alongRay(ray, expected);
  expectSame(expected, found, here, counts);
  EXPECT_GE(slow_->most_under_way, 8);
  EXPECT_LE(static_cast<std::uint32_t>(slow_->reads), counts.tiles_searched);
  ray.most = 2;
  here = Nearest(*near_, options_).alongRay(ray, expected);
  const SearchCounts there = Nearest(*far_, options_).alongRay(ray, found);
  expectSame(expected, found, here, there);
}

TEST_P(ManyTilesAtOnceTest, Radius) {
  const NearestQuery query{.k = SIZE_MAX, .max_distance_um = 100};
  std::vector<NearestResult> found, expected;
  const SearchCounts counts = far_away_.find(Vector3d(1, 2, 3), query, found);
  ASSERT_FALSE(found.empty());
  const SearchCounts here = nearby_.find(Vector3d(1, 2, 3), query, expected);
  expectSame(expected, found, here, counts);
  EXPECT_GE(slow_->most_under_way, 16);
  EXPECT_LE(static_cast<std::uint32_t>(slow_->reads), counts.tiles_searched + 4);
}

TEST_P(ManyTilesAtOnceTest, Batch) {
  const std::vector<Vector3d> points = places(43, 100);
  const NearestQuery query{.k = 2};
  std::vector<std::vector<NearestResult>> found(points.size()), expected(points.size());
  std::vector<SearchCounts> here(points.size()), there(points.size());
  const auto into = [](auto& results, auto& counts) {
    return [&](std::size_t i, std::vector<NearestResult>&& of, const SearchCounts& cost) {
      results[i] = std::move(of);
      counts[i] = cost;
    };
  };
  far_away_.forEach(points, query, 1, into(found, there));
  nearby_.forEach(points, query, 1, into(expected, here));
  for (std::size_t i = 0; i < points.size(); ++i) expectSame(expected[i], found[i], here[i], there[i]);
  EXPECT_GE(slow_->most_under_way, 16) << "seed 43";
}

TEST_P(ManyTilesAtOnceTest, TileThatFailsOnceIsReadAgain) {
  const_cast<test::SlowFolder*>(slow_)->fail_at = 10;
  const Vector3d corner_W = Vector3d::Constant(120);
  expectSame(nearby_.inBox(-corner_W, corner_W), far_away_.inBox(-corner_W, corner_W));
}

TEST_P(ManyTilesAtOnceTest, Filters) {
  const std::vector<std::uint32_t> one{3}, some{1, 4, 5, 9, 17};
  for (const SegmentFilter& filter : {SegmentFilter{.cells = {}, .types = {7}}, SegmentFilter{.cells = one},
                                      SegmentFilter{.cells = some}, SegmentFilter{.cells = some, .types = {7, 2}}}) {
    NearestOptions options = options_;
    options.filter = filter;
    const Nearest nearby(*near_, options), far_away(*far_, options);
    const std::vector<Vector3d> points = places(45, GetParam() == 0 ? 8 : 80);
    const auto found = far_away.findAll(points, {.k = 3}), expected = nearby.findAll(points, {.k = 3});
    for (std::size_t i = 0; i < points.size(); ++i) expectSame(expected[i], found[i]);
    const Vector3d corner_W = Vector3d::Constant(100);
    expectSame(nearby.inBox(-corner_W, corner_W), far_away.inBox(-corner_W, corner_W));
    const RayQuery ray{.origin_W = Vector3d(-400, 3, 5), .direction = Vector3d(1, .1, .05), .radius_um = 30, .most = 5};
    expectSame(nearby.alongRay(ray), far_away.alongRay(ray));
  }
}

// Few rounds of reads, each waited for once. Tile by tile, there would be as many rounds as tiles. A thread that starts
// late can make two rounds of one, so reads are slow, and all bounds are doubled.
class RoundsOfReadsTest : public NearestRemoteTest {
 protected:
  RoundsOfReadsTest() { const_cast<test::SlowFolder*>(slow_)->wait_ms = 100; }
  // Of `tiles` that are read kLeastAhead at a time; or first `first`, then twice as many each time.
  static int most(std::uint32_t tiles, std::uint32_t first = internal::TileCache::kLeastAhead) {
    int rounds = 0;
    for (std::uint32_t done = 0; done < tiles; ++rounds, first = std::min<std::uint32_t>(2 * first, 64)) done += first;
    return 2 * rounds;
  }
  int rounds() const { return slow_->rounds; }
  const Nearest far_away_{*far_};
};

TEST_F(RoundsOfReadsTest, Box) {
  std::vector<NearestResult> found;
  const std::uint32_t tiles =
      far_away_.inBox(Vector3d::Constant(-120), Vector3d::Constant(120), false, found).tiles_read;
  ASSERT_GT(tiles, 64u);
  EXPECT_LE(rounds(), most(tiles));
}

TEST_F(RoundsOfReadsTest, Ray) {
  RayQuery ray{.origin_W = Vector3d(-400, 3, 5), .direction = Vector3d(1, .1, .05), .radius_um = 60, .most = 400};
  std::vector<RayHit> hits;
  const std::uint32_t tiles = far_away_.alongRay(ray, hits).tiles_read;
  ASSERT_GT(tiles, 16u);
  EXPECT_LE(rounds(), most(tiles, 4));
}

// A point needs at most six rounds: 2, 4 .. 64 tiles. Meanwhile 64 points are under way.
TEST_F(RoundsOfReadsTest, Batch) {
  far_away_.findAll(places(44, 400), {.k = 2});
  ASSERT_GT(slow_->reads, 100);
  EXPECT_LE(rounds(), 2 * 6 + most(static_cast<std::uint32_t>(slow_->reads))) << "seed 44";
}

INSTANTIATE_TEST_SUITE_P(Memory, ManyTilesAtOnceTest, ::testing::Values(0, UINT64_MAX));

}  // namespace
}  // namespace filiform
