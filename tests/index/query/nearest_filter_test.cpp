// Searches with filters, and for cells: exactly what brute force over the wanted segments finds.
#include "index/errors.h"
#include "index/geometry/partition.h"
#include "index/query/nearest.h"
#include "index/set/forwarding_store.h"
#include "tests/support/scenes/brute_force.h"
#include "tests/support/scenes/counting_store.h"
#include "tests/support/scenes/memory_store.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/scenes/tile_invariants.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numeric>
#include <random>
#include <set>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::storeOf;
using Ids = std::vector<std::uint32_t>;
using Segments = std::vector<StoredSegment>;

// Cells whose samples have one of three types along a stretch, and a rare one here and there.
std::vector<test::NamedCells> typedCases() {
  std::vector<test::NamedCells> all = test::worstCases();
  all.push_back({"column", test::randomColumn(61, 24, 500, 200)});
  all.push_back({"sparse", test::randomColumn(62, 6, 200, 1e5)});
  std::mt19937_64 random(63);
  for (test::NamedCells& named : all)
    for (Cell& cell : named.cells) {
      std::uint16_t type = 2;
      for (std::uint16_t& of_sample : cell.types) {
        if (random() % 40 == 0) type = static_cast<std::uint16_t>(2 + random() % 3);
        of_sample = random() % 100 == 0 ? 700 : type;
      }
    }
  return all;
}

struct Wanted {
  const char* name;
  SegmentFilter filter;
};

std::vector<Wanted> filtersOf(std::uint32_t cells) {
  Ids odd, all_but_one;
  for (std::uint32_t c = 0; c < cells; ++c) {
    if (c % 2 == 1) odd.push_back(c);
    if (c != 0) all_but_one.push_back(c);
  }
  std::vector<Wanted> all{
      {"everything", {}},
      {"a type", {.types = {3}}},
      {"a rare type", {.types = {700}}},
      {"two types", {.types = {700, 2}}},
      {"a type that none has", {.types = {701}}},
      {"all but one cell", {.cells = all_but_one}},
      {"every second cell's", {.cells = odd, .types = {4}}},
      {"no cell", {.cells = Ids()}},
      {"a function", {.wants = [](std::uint32_t c, int type) { return (c + type) % 3 == 0; }}},
      {"of a type, by a function", {.types = {3, 4}, .wants = [](auto c, auto) { return c % 2; }}},
      {"of cells, by a function", {.cells = odd, .wants = [](auto, auto type) { return type != 3; }}},
      {"what no function wants", {.wants = [](auto, auto) { return false; }}}};
  if (cells > 0) all.push_back({"a cell", {.cells = Ids{cells / 2}}});
  if (cells > 0) all.push_back({"a cell's", {.cells = Ids{cells / 2}, .types = {3, 700}}});
  return all;
}

std::vector<StoredSegment> sifted(std::vector<StoredSegment> segments, const std::vector<Cell>& cells,
                                  const SegmentFilter& filter) {
  std::erase_if(segments, [&](const StoredSegment& s) {
    const auto has = [](const auto& list, auto value) {
      return std::find(list.begin(), list.end(), value) != list.end();
    };
    return (filter.cells && !has(*filter.cells, s.id.cell)) ||
           (!filter.types.empty() && !has(filter.types, cells[s.id.cell].types[s.child_sample])) ||
           (filter.wants && !filter.wants(s.id.cell, cells[s.id.cell].types[s.child_sample]));
  });
  return segments;
}

// The nearest segment of each of the k nearest cells.
std::vector<test::BruteForceResult> ofCells(const std::vector<test::BruteForceResult>& all, std::size_t k) {
  std::set<std::uint32_t> seen;
  std::vector<test::BruteForceResult> firsts;
  for (const test::BruteForceResult& r : all)
    if (firsts.size() < k && seen.insert(r.segment.cell).second) firsts.push_back(r);
  return firsts;
}

template <class Found>
void expectSegments(const std::vector<Found>& found, const std::vector<SegmentId>& expected) {
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t i = 0; i < found.size(); ++i) EXPECT_EQ(found[i].segment, expected[i]) << "rank " << i;
}

void expectExactly(const std::vector<NearestResult>& found, const std::vector<test::BruteForceResult>& expected) {
  std::vector<SegmentId> ids;
  for (const test::BruteForceResult& r : expected) ids.push_back(r.segment);
  expectSegments(found, ids);
  for (std::size_t i = 0; i < std::min(found.size(), expected.size()); ++i) {
    EXPECT_EQ(found[i].p_W, expected[i].p_W);
    EXPECT_TRUE(found[i].exact);
  }
}

class FilteredNearest : public ::testing::TestWithParam<TileEngineKind> {
 protected:
  // Calls check(nearest, wanted segments, their store, point, all segments) for all scenes, tilings and filters.
  template <class Check>
  static void forAll(const Check& check) {
    for (const test::NamedCells& named : typedCases()) {
      const std::vector<StoredSegment> segments = test::snappedSegments(named.cells, Grid());
      if (segments.empty()) continue;
      for (const std::uint32_t capacity : {8u, 100u}) {
        const auto store = storeOf(named.cells, capacity);
        const test::CountingStore few(*store, 100);
        for (const Wanted& wanted : filtersOf(static_cast<std::uint32_t>(named.cells.size()))) {
          SCOPED_TRACE(named.name + ", " + wanted.name + ", capacity " + std::to_string(capacity) + ", seed 64");
          std::mt19937_64 random(64);
          const Nearest nearest(few, {.engine = GetParam(), .filter = wanted.filter});
          const std::vector<StoredSegment> left = sifted(segments, named.cells, wanted.filter);
          for (int i = 0; i < 6; ++i) {
            std::normal_distribution<double> jitter(0, i < 2 ? 0 : i < 4 ? 1 : 30);
            const Vector3d at_W = store->grid().toWorld(segments[random() % segments.size()].child) +
                                  Vector3d(jitter(random), jitter(random), jitter(random));
            check(nearest, left, *store, at_W, segments);
          }
        }
      }
    }
  }
};

TEST_P(FilteredNearest, PointIsBruteForceOverTheWanted) {
  forAll([](const Nearest& nearest, const Segments& left, const TileStore& store, const Vector3d& at_W,
            const Segments& all_segments) {
    const auto all = test::bruteForceNearest(left, store.grid(), at_W, SIZE_MAX);
    const auto first = [&](std::size_t k) {
      return std::vector(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(std::min(k, all.size())));
    };
    for (const std::size_t k : {1, 7}) {
      expectExactly(nearest.find(at_W, {.k = k}), first(k));
      expectExactly(nearest.find(at_W, {.k = k, .of_cells = true}), ofCells(all, k));
    }
    const double radius = all.empty() ? 10 : all[std::min<std::size_t>(all.size() - 1, 20)].distance_um;
    std::vector<test::BruteForceResult> within = all;
    std::erase_if(within, [&](const auto& r) { return r.distance_um > radius; });
    expectExactly(nearest.find(at_W, {.k = SIZE_MAX, .max_distance_um = radius}), within);
    const std::uint32_t own = test::bruteForceNearest(all_segments, store.grid(), at_W, 1).at(0).segment.cell;
    auto of_others = all;
    std::erase_if(of_others, [&](const auto& r) { return r.segment.cell == own; });
    for (const std::size_t k : {1, 3}) {
      const auto some = of_others.begin() + static_cast<std::ptrdiff_t>(std::min(k, of_others.size()));
      expectExactly(nearest.find(at_W, {.k = k, .other_cells = true}), {of_others.begin(), some});
    }
    // What is in memory now holds the answer, and says so.
    const auto others = nearest.find(at_W, {.resident_only = true, .other_cells = true});
    EXPECT_EQ(others.size(), std::min<std::size_t>(of_others.size(), 1));
    for (const NearestResult& r : others) EXPECT_EQ(r.segment, of_others[0].segment);
    expectExactly(nearest.find(at_W, {.resident_only = true}), first(1));
  });
}

TEST_P(FilteredNearest, BoxIsBruteForceOverTheWanted) {
  forAll(
      [](const Nearest& nearest, const Segments& left, const TileStore& store, const Vector3d& at_W, const Segments&) {
        for (const std::int64_t reach : {64, 40000}) {
          const GridPoint at = store.grid().snap(at_W);
          const GridBox box{at.array() - reach, at.array() + reach};
          std::vector<StoredSegment> inside = left;
          std::erase_if(inside, [&](const StoredSegment& s) { return !segmentMeetsBox(s.child, s.parent, box); });
          const Vector3d lo_W = store.grid().toWorld(box.lo), hi_W = store.grid().toWorld(box.hi);
          const auto all = test::bruteForceNearest(inside, store.grid(), 0.5 * (lo_W + hi_W), SIZE_MAX);
          expectExactly(nearest.inBox(lo_W, hi_W), all);
          expectExactly(nearest.inBox(lo_W, hi_W, true), ofCells(all, SIZE_MAX));
          std::set<SegmentId> parts;
          for (std::optional<BoxPlace> place = BoxPlace{}; place;) {
            const BoxPart part = nearest.partOfBox(lo_W, hi_W, *place, 5);
            for (const NearestResult& r : part.results) EXPECT_TRUE(parts.insert(r.segment).second);
            place = part.next;
          }
          EXPECT_EQ(parts.size(), all.size());
        }
      });
}

TEST_P(FilteredNearest, RayIsBruteForceOverTheWanted) {
  forAll(
      [](const Nearest& nearest, const Segments& left, const TileStore& store, const Vector3d& at_W, const Segments&) {
        RayQuery ray{.origin_W = at_W - Vector3d(30, 20, 10), .direction = Vector3d(3, 2, 1), .radius_um = 3};
        const Vector3d unit = ray.direction / ray.direction.norm();
        std::vector<std::pair<double, SegmentId>> expected;
        for (const StoredSegment& s : left) {
          const ClosestApproach c =
              closestApproach(store.grid().toWorld(s.child), store.grid().toWorld(s.parent), ray.origin_W, unit);
          if (std::sqrt(c.squared_distance) <= ray.radius_um) expected.emplace_back(c.along, s.id);
        }
        std::sort(expected.begin(), expected.end());
        for (const bool of_cells : {false, true})
          for (const std::size_t most : {std::size_t{2}, SIZE_MAX}) {
            ray.of_cells = of_cells, ray.most = most;
            std::set<std::uint32_t> seen;
            std::vector<SegmentId> ids;
            for (const auto& [along, id] : expected)
              if (ids.size() < most && (!of_cells || seen.insert(id.cell).second)) ids.push_back(id);
            expectSegments(nearest.alongRay(ray), ids);
          }
      });
}

INSTANTIATE_TEST_SUITE_P(Engines, FilteredNearest, ::testing::Values(TileEngineKind::packed, TileEngineKind::cgal));

TEST(FilteredNearestTiles, OnlyTilesThatMayHoldTheWantedAreRead) {
  std::vector<Cell> cells = test::randomColumn(65, 40, 400, 300);
  for (Cell& cell : cells) std::fill(cell.types.begin(), cell.types.end(), 2);
  std::fill(cells[5].types.begin(), cells[5].types.end(), 4);
  const auto store = storeOf(cells, 32);
  const std::vector<TileId> of_cell = store->loadCellDetail(5).tiles;
  ASSERT_GT(store->tile_count(), 10 * of_cell.size());
  {
    const test::CountingStore counted(*store, 100);
    const Nearest nearest(counted, {.filter = {.types = {4}}});
    ASSERT_EQ(nearest.find(Vector3d::Zero()).at(0).segment.cell, 5u);
    for (const TileId tile : counted.loads()) EXPECT_TRUE(store->entry(tile).types & typeMaskOf(4)) << tile;
  }
  const test::CountingStore counted(*store, 100);
  const Nearest nearest(counted, {.filter = {.cells = Ids{5}}});
  std::vector<NearestResult> found;
  EXPECT_EQ(nearest.find(Vector3d::Zero(), {}, found).tiles_read, of_cell.size()) << "once, the tiles of the cell";
  const SearchCounts second = nearest.find(Vector3d::Constant(50), {}, found);
  EXPECT_EQ(second.tiles_read, 0u);
  EXPECT_LT(second.tiles_searched, of_cell.size() / 2);
  EXPECT_EQ(counted.loads().size(), of_cell.size());
}

// Counts how often it is asked for the tile of a place.
struct CountingHomes final : ForwardingStore {
  using ForwardingStore::ForwardingStore;
  TileId home(const GridPoint& p) const override {
    ++asked;
    return ForwardingStore::home(p);
  }
  mutable std::atomic<std::size_t> asked{0};
};

TEST(FilteredNearestTiles, GhostsAreSettledOnceTheirOwnersAreInMemory) {
  std::vector<Cell> cells = test::randomColumn(67, 30, 500, 150);
  std::mt19937_64 random(68);  // the seed of types and points
  for (Cell& cell : cells)
    for (std::uint16_t& type : cell.types) type = random() % 100 == 0 ? 700 : 800;
  const auto store = storeOf(cells, 40);
  const SegmentFilter filter{.types = {700}};
  const Segments all = test::snappedSegments(cells, Grid());
  const Segments left = sifted(all, cells, filter);
  std::vector<Vector3d> points;
  std::normal_distribution<double> jitter(0, 2);
  for (int i = 0; i < 300; ++i)
    points.push_back(store->grid().toWorld(all[random() % all.size()].child) +
                     Vector3d(jitter(random), jitter(random), jitter(random)));
  std::vector<std::vector<test::BruteForceResult>> expected;
  for (const Vector3d& p_W : points) expected.push_back(test::bruteForceNearest(left, store->grid(), p_W, 1));
  for (const std::uint64_t budget :
       {std::uint64_t{60'000}, std::uint64_t{64} << 20}) {  // some tiles leave memory; none
    const CountingHomes counted(*store);
    const Nearest nearest(counted, {.budget_bytes = budget, .filter = filter});
    for (int round = 0; round < 20; ++round) {
      counted.asked = 0;
      const auto found = nearest.findAll(points, {}, 3);
      for (std::size_t i = 0; i < points.size(); ++i) expectExactly(found[i], expected[i]);
    }
    if (budget > 1 << 20) {
      EXPECT_LE(counted.asked, points.size()) << "the point's own tile, and no ghost's";
    }
  }
}

TEST(FilteredNearestTiles, RefusesWrongCellsAndApproximateSearches) {
  const auto store = storeOf(test::randomColumn(66, 3, 60, 30), 16);
  EXPECT_THROW(Nearest(*store, {.filter = {.cells = Ids{3}}}), UsageError);
  EXPECT_THROW(Nearest(*store, {.filter = {.cells = Ids{1, 0}}}), UsageError);
  const Nearest nearest(*store, {.filter = {.types = {3}}});
  EXPECT_THROW(nearest.find(Vector3d::Zero(), {.approximate = true}), UsageError);
  EXPECT_THROW(Nearest(*store).find(Vector3d::Zero(), {.approximate = true, .of_cells = true}), UsageError);
  EXPECT_THROW(Nearest(*store).find(Vector3d::Zero(), {.approximate = true, .other_cells = true}), UsageError);
}

}  // namespace
}  // namespace filiform
