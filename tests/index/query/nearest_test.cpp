#include "index/query/nearest.h"

#include "index/errors.h"
#include "index/geometry/partition.h"
#include "tests/support/no_alloc_guard.h"
#include "tests/support/scenes/brute_force.h"
#include "tests/support/scenes/counting_store.h"
#include "tests/support/scenes/memory_store.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/scenes/tile_invariants.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <thread>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::storeOf;

constexpr std::size_t kAllSegments = std::numeric_limits<std::size_t>::max();

// Few landmarks: chosen quickly, with loose bounds, which is the harder case.
constexpr std::size_t kLandmarks = 200;

// Points on nodes, near nodes, among them, and far away.
std::vector<Vector3d> probes(const std::vector<StoredSegment>& segments, const Grid& grid, std::uint64_t seed, int n) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  const auto jitter = [&](double size) {
    return Vector3d(size * Vector3d(normal(random), normal(random), normal(random)));
  };
  const auto node = [&] { return grid.toWorld(segments[random() % segments.size()].child); };
  GridBox bounds;
  for (const StoredSegment& s : segments) bounds.extend(s.child), bounds.extend(s.parent);
  const Vector3d lo_W = grid.toWorld(bounds.lo), size_W = grid.toWorld(bounds.hi) - lo_W;
  std::uniform_real_distribution<double> unit;
  std::vector<Vector3d> all;
  for (int i = 0; i < n; ++i) {
    all.push_back(node());
    all.push_back(node() + jitter(0.5));
    all.push_back(0.5 * (node() + node()));
    all.push_back(lo_W + size_W.cwiseProduct(Vector3d(unit(random), unit(random), unit(random))));
  }
  for (const double distance : {1e2, 1e4, 1e7, 1e12, 1e100, 1e150})
    all.push_back((node() + jitter(distance / 4)).cwiseMax(-1e150).cwiseMin(1e150));
  return all;
}

void expectExact(const std::vector<NearestResult>& found, const std::vector<test::BruteForceResult>& expected) {
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    EXPECT_EQ(found[i].rank, i);
    EXPECT_EQ(found[i].segment, expected[i].segment) << "rank " << i;
    EXPECT_NEAR(found[i].distance_um, expected[i].distance_um, 1e-12 * expected[i].distance_um);
    EXPECT_EQ(found[i].p_W, expected[i].p_W);
    EXPECT_EQ(found[i].t, expected[i].t);
    EXPECT_TRUE(found[i].exact);
  }
}

std::vector<test::NamedCells> storeCases() {
  std::vector<test::NamedCells> all = test::worstCases();
  all.push_back({"column", test::randomColumn(21, 12, 600, 300)});
  all.push_back({"sparse", test::randomColumn(22, 6, 200, 1e5)});
  return all;
}

TEST(Nearest, ExactIsBruteForceInAnyTiling) {
  for (const test::NamedCells& named : storeCases()) {
    std::vector<StoredSegment> segments = test::snappedSegments(named.cells, Grid());
    if (segments.empty()) continue;
    const std::vector<Vector3d> points = probes(segments, Grid(), 31, 5);
    for (const std::uint32_t capacity : {8u, 2048u}) {
      SCOPED_TRACE(named.name + ", capacity " + std::to_string(capacity) + ", seed 31");
      const auto store = storeOf(named.cells, capacity);
      const test::CountingStore few(*store, kLandmarks);
      const Nearest nearest(few);
      for (const Vector3d& h_W : points) {
        SCOPED_TRACE(h_W.transpose());
        const auto expected = test::bruteForceNearest(segments, store->grid(), h_W, 50);
        for (const std::size_t k : {1, 5, 50})
          expectExact(nearest.find(h_W, {.k = k}), {expected.begin(), expected.begin() + std::min(k, expected.size())});
      }
    }
  }
}

TEST(Nearest, EpsilonIsNeverExceededAtAnyRank) {
  const std::vector<Cell> cells = test::randomColumn(23, 12, 600, 300);
  const auto store = storeOf(cells, 16);
  const std::vector<StoredSegment> segments = test::snappedSegments(cells, store->grid());
  const test::CountingStore few(*store, kLandmarks);
  const Nearest nearest(few);
  for (const Vector3d& h_W : probes(segments, store->grid(), 41, 20)) {
    const auto expected = test::bruteForceNearest(segments, store->grid(), h_W, 50);
    for (const double epsilon : {0.01, 0.5, 10.0})
      for (const std::size_t k : {1, 5, 50}) {
        const auto found = nearest.find(h_W, {.k = k, .epsilon = epsilon});
        ASSERT_EQ(found.size(), k);
        for (std::size_t i = 0; i < k; ++i) {
          EXPECT_LE(found[i].distance_um, (1 + epsilon) * expected[i].distance_um * (1 + 1e-12));
          EXPECT_GE(found[i].distance_um, expected[i].distance_um);
          EXPECT_FALSE(found[i].exact);
        }
      }
  }
}

TEST(Nearest, EpsilonSavesTiles) {
  const std::vector<Cell> cells = test::randomColumn(23, 12, 600, 300);
  const auto store = storeOf(cells, 16);
  const test::CountingStore few(*store, kLandmarks);
  const Nearest nearest(few);
  std::uint64_t exact = 0, loose = 0;
  std::vector<NearestResult> found;
  for (const Vector3d& h_W : probes(test::snappedSegments(cells, store->grid()), store->grid(), 43, 40)) {
    exact += nearest.find(h_W, {}, found).tiles_searched;
    loose += nearest.find(h_W, {.epsilon = 1.0}, found).tiles_searched;
  }
  EXPECT_LT(loose, exact);
}

TEST(Nearest, ApproximateIsWithinTheCoveringRadiusAndReadsNoTile) {
  for (const test::NamedCells& named : storeCases()) {
    SCOPED_TRACE(named.name);
    const auto store = storeOf(named.cells, 64);
    const test::CountingStore counted(*store, kLandmarks);
    const Nearest nearest(counted);
    const std::vector<StoredSegment> segments = test::snappedSegments(named.cells, store->grid());
    if (segments.empty()) continue;
    for (const Vector3d& h_W : probes(segments, store->grid(), 51, 10)) {
      std::vector<NearestResult> found;
      EXPECT_EQ(nearest.find(h_W, {.approximate = true}, found).tiles_read, 0u);
      ASSERT_EQ(found.size(), 1u);
      const double truth = test::bruteForceNearest(segments, store->grid(), h_W, 1)[0].distance_um;
      EXPECT_LE(found[0].distance_um, (truth + nearest.covering_radius_um()) * (1 + 1e-12) + 1e-6);
      EXPECT_FALSE(found[0].exact);
    }
    EXPECT_TRUE(counted.loads().empty());
  }
}

TEST(Nearest, EquidistantSegmentsComeInTheOrderOfTheirIds) {
  std::vector<Cell> cells(20);
  for (Cell& cell : cells)  // spokes on a circle about the probe, pointing outward, the same in every cell
    for (int i = 0; i < 4; ++i) {
      const Vector3d d = i % 2 == 0 ? Vector3d(i == 0 ? 8 : -8, 0, 0) : Vector3d(0, i == 1 ? 8 : -8, 0);
      const std::uint32_t root = test::addSample(cell, d);
      test::addSample(cell, 2 * d, root);
    }
  const auto segments = test::snappedSegments(cells, Grid());
  for (const std::uint32_t capacity : {1u, 8u, 2048u}) {
    const auto store = storeOf(cells, capacity);
    const test::CountingStore few(*store, kLandmarks);
    const Nearest nearest(few);
    const auto found = nearest.find(Vector3d::Zero(), {.k = 50});
    expectExact(found, test::bruteForceNearest(segments, store->grid(), Vector3d::Zero(), 50));
    for (const NearestResult& r : found) EXPECT_EQ(r.distance_um, 8.0);
    EXPECT_TRUE(
        std::is_sorted(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.segment < b.segment; }));
  }
}

TEST(Nearest, ThinGapsBetweenCellsHideNothing) {
  std::mt19937_64 random(61);
  SCOPED_TRACE("seed 61");
  std::vector<Cell> cells = test::randomColumn(61, 8, 400, 200);
  Cell slanted;  // nearly axis-parallel segments near the planes that cut blocks
  for (int i = 0; i < 300; ++i) {
    const double q = Grid().quantum_um();
    Vector3d a_W(q * (static_cast<double>(random() % 5) - 2), static_cast<double>(random() % 200) - 100,
                 static_cast<double>(random() % 64) - 32),
        b_W = a_W;
    b_W[i % 3] += 60;
    b_W[(i + 1) % 3] += q;
    const std::uint32_t root = test::addSample(slanted, a_W);
    test::addSample(slanted, b_W, root);
  }
  cells.push_back(slanted);
  const auto segments = test::snappedSegments(cells, Grid());
  const auto store = storeOf(cells, 4);
  const test::CountingStore few(*store, kLandmarks);
  const Nearest nearest(few);
  for (std::size_t i = segments.size() - 300; i < segments.size(); ++i) {
    const Vector3d middle_W =
        0.5 * (store->grid().toWorld(segments[i].child) + store->grid().toWorld(segments[i].parent));
    expectExact(nearest.find(middle_W, {.k = 3}), test::bruteForceNearest(segments, store->grid(), middle_W, 3));
  }
}

TEST(Nearest, WithinARadiusIsAllAndOnlyThose) {
  const std::vector<Cell> cells = test::randomColumn(25, 8, 400, 200);
  const auto store = storeOf(cells, 8);
  const test::CountingStore few(*store, kLandmarks);
  const Nearest nearest(few);
  const auto segments = test::snappedSegments(cells, store->grid());
  for (const Vector3d& h_W : probes(segments, store->grid(), 71, 10)) {
    const auto all = test::bruteForceNearest(segments, store->grid(), h_W, segments.size());
    const double radius_um = all[20].distance_um;  // closed: this segment belongs to the result
    auto expected = all;
    std::erase_if(expected, [&](const auto& r) { return r.distance_um > radius_um; });
    expectExact(nearest.find(h_W, {.k = kAllSegments, .max_distance_um = radius_um}), expected);
    expected.resize(3);
    expectExact(nearest.find(h_W, {.k = 3, .max_distance_um = radius_um}), expected);
  }
  EXPECT_EQ(nearest.find(Vector3d::Zero(), {.k = kAllSegments}).size(), segments.size());
}

TEST(Nearest, ResidentOnlyReadsNothingAndOwnsUpToIt) {
  const std::vector<Cell> cells = test::randomColumn(27, 12, 600, 300);
  const auto store = storeOf(cells, 16);
  ASSERT_GT(store->tile_count(), 64u);
  const test::CountingStore counted(*store, kLandmarks);
  const Nearest nearest(counted);
  const auto segments = test::snappedSegments(cells, store->grid());
  const auto points = probes(segments, store->grid(), 81, 10);
  EXPECT_TRUE(nearest.find(points[0], {.resident_only = true}).empty());
  EXPECT_TRUE(counted.loads().empty());
  EXPECT_EQ(counted.landmarkReads(), 0u);

  std::size_t exact = 0, inexact = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (i % 2 == 0) nearest.find(points[i]);
    const std::size_t loads = counted.loads().size();
    const auto expected = test::bruteForceNearest(segments, store->grid(), points[i], 5);
    std::vector<NearestResult> found;
    EXPECT_EQ(nearest.find(points[i], {.k = 5, .resident_only = true}, found).tiles_read, 0u);
    EXPECT_EQ(counted.loads().size(), loads);
    for (std::size_t r = 0; r < found.size(); ++r) {
      EXPECT_GE(found[r].distance_um, expected[r].distance_um);
      EXPECT_TRUE(!found[r].exact || found[r].segment == expected[r].segment);
      (found[r].exact ? exact : inexact)++;
    }
  }
  EXPECT_GT(exact, 0u);
  EXPECT_GT(inexact, 0u);
}

TEST(Nearest, OpensFewTilesAndReadsThemOnce) {
  const std::vector<Cell> cells = test::randomColumn(29, 30, 800, 300);
  const auto store = storeOf(cells, 64);
  ASSERT_GT(store->tile_count(), 200u);
  const test::CountingStore counted(*store, kLandmarks);
  const Nearest nearest(counted);
  const auto segments = test::snappedSegments(cells, store->grid());
  std::mt19937_64 random(91);
  std::uint64_t searched = 0, reads = 0;
  for (int i = 0; i < 200; ++i) {
    const Vector3d h_W = store->grid().toWorld(segments[random() % segments.size()].child) + 0.1 * Vector3d::Random();
    std::vector<NearestResult> found;
    const SearchCounts counts = nearest.find(h_W, {}, found);
    searched += counts.tiles_searched;
    reads += counts.tiles_read;
    EXPECT_EQ(nearest.find(h_W, {}, found).tiles_read, 0u);
  }
  EXPECT_LT(searched, 200 * 3u);
  EXPECT_EQ(counted.loads().size(), reads);
  for (TileId tile = 0; tile < store->tile_count(); ++tile) EXPECT_LE(counted.loads(tile), 1u);
}

TEST(Nearest, FewTilesNeedNeitherSamplesNorTrees) {
  const std::vector<Cell> cells = test::randomColumn(30, 4, 300, 100);
  const auto store = storeOf(cells, 2048);
  const test::CountingStore counted(*store, kLandmarks);
  const Nearest nearest(counted);
  nearest.find(Vector3d::Zero(), {.k = 5});
  EXPECT_EQ(counted.landmarkReads(), 0u);
}

TEST(Nearest, CacheKeepsItsBudgetAndAnswersWithoutOne) {
  const std::vector<Cell> cells = test::randomColumn(33, 12, 600, 300);
  const auto store = storeOf(cells, 32);
  const auto segments = test::snappedSegments(cells, store->grid());
  for (const std::uint64_t budget : {std::uint64_t{0}, std::uint64_t{200000}}) {
    const test::CountingStore counted(*store, kLandmarks);
    const Nearest nearest(counted, {.budget_bytes = budget});
    for (const Vector3d& h_W : probes(segments, store->grid(), 95, 10)) {
      expectExact(nearest.find(h_W, {.k = 5}), test::bruteForceNearest(segments, store->grid(), h_W, 5));
      EXPECT_LE(nearest.bytes(), budget);
    }
  }
}

TEST(Nearest, EmptySetHasNoResults) {
  const auto store = storeOf({}, 64);
  const test::CountingStore few(*store, kLandmarks);
  const Nearest nearest(few);
  EXPECT_TRUE(nearest.find(Vector3d::Zero()).empty());
  EXPECT_TRUE(nearest.find(Vector3d::Zero(), {.k = 9, .approximate = true}).empty());
  EXPECT_TRUE(nearest.find(Vector3d::Zero(), {.resident_only = true}).empty());
}

TEST(Nearest, RefusesWhatMakesNoSense) {
  const auto store = storeOf({test::comb(20)}, 64);
  const test::CountingStore few(*store, kLandmarks);
  const Nearest nearest(few);
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN(), kInf = std::numeric_limits<double>::infinity();
  for (const double bad : {kNaN, kInf, -kInf, 1e300})
    for (int axis = 0; axis < 3; ++axis) {
      Vector3d h_W = Vector3d::Zero();
      h_W[axis] = bad;
      EXPECT_THROW(nearest.find(h_W), UsageError);
      EXPECT_THROW(nearest.find(h_W, {.approximate = true}), UsageError);
      EXPECT_THROW(nearest.find(h_W, {.resident_only = true}), UsageError);
    }
  for (const double bad : {kNaN, kInf, -0.5})
    EXPECT_THROW(nearest.find(Vector3d::Zero(), {.epsilon = bad}), UsageError);
  EXPECT_THROW(nearest.find(Vector3d::Zero(), {.max_distance_um = -1}), UsageError);
  EXPECT_THROW(nearest.find(Vector3d::Zero(), {.max_distance_um = kNaN}), UsageError);
  EXPECT_TRUE(nearest.find(Vector3d::Zero(), {.k = 0}).empty());
  const auto visit = [](const NearestResult&) { return true; };
  EXPECT_THROW(nearest.forEachNearest(Vector3d::Zero(), {.epsilon = 1}, visit), UsageError);
  EXPECT_THROW(nearest.forEachNearest(Vector3d::Zero(), {.resident_only = true}, visit), UsageError);
}

TEST(Nearest, DamagedTileIsAnErrorNotAnAnswer) {
  const std::vector<Cell> cells = test::randomColumn(35, 4, 300, 100);
  const auto store = storeOf(cells, 64);
  test::CountingStore counted(*store);
  const Nearest nearest(counted);
  const NearestResult r = Nearest(*store).find(Vector3d::Zero()).at(0);
  counted.failLoads(r.tile, 1);
  EXPECT_THROW(nearest.find(Vector3d::Zero()), CorruptTile);
  EXPECT_EQ(nearest.find(Vector3d::Zero()).at(0).segment, r.segment);
}

TEST(Nearest, AnswersManyPointsInTheirOrder) {
  const std::vector<Cell> cells = test::randomColumn(41, 12, 400, 300);
  const auto store = storeOf(cells, 32);
  const auto points = probes(test::snappedSegments(cells, store->grid()), store->grid(), 41, 60);
  const Nearest nearest(*store);
  for (const unsigned threads : {1u, 3u}) {
    const auto all = nearest.findAll(points, {.k = 2}, threads);
    ASSERT_EQ(all.size(), points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto one = nearest.find(points[i], {.k = 2});
      ASSERT_EQ(all[i].size(), one.size());
      for (std::size_t r = 0; r < one.size(); ++r) EXPECT_EQ(all[i][r].segment, one[r].segment);
    }
  }
  EXPECT_TRUE(nearest.findAll({}).empty());
}

TEST(Nearest, VisitorsSeeWhatListsHoldUntilTheyEnd) {
  for (const test::NamedCells& named : storeCases()) {
    SCOPED_TRACE(named.name + ", seed 44");
    const auto store = storeOf(named.cells, 50);
    const auto segments = test::snappedSegments(named.cells, store->grid());
    if (segments.empty()) continue;
    const Nearest nearest(*store);
    for (const Vector3d& h_W : probes(segments, store->grid(), 44, 4)) {
      const RayQuery ray{.origin_W = h_W, .direction = Vector3d(1, 2, 3), .radius_um = 40};
      const Vector3d lo_W = h_W - Vector3d::Constant(60), hi_W = h_W + Vector3d::Constant(60);
      std::vector<NearestResult> all = nearest.find(h_W, {.k = SIZE_MAX}), in_box = nearest.inBox(lo_W, hi_W);
      const std::vector<RayHit> hits = nearest.alongRay(ray);
      const auto isLower = [](const auto& a, const auto& b) { return a.segment < b.segment; };
      std::sort(in_box.begin(), in_box.end(), isLower);
      for (const std::size_t most : {std::size_t{1}, std::size_t{8}, std::size_t{9}, SIZE_MAX}) {
        std::vector<SegmentId> seen, boxed, hit;
        nearest.forEachNearest(h_W, {}, [&](const NearestResult& r) {
          EXPECT_EQ(r.rank, seen.size());
          seen.push_back(r.segment);
          return seen.size() < most;
        });
        nearest.forEachAlongRay(ray, [&](const RayHit& r) { return hit.push_back(r.segment), hit.size() < most; });
        nearest.forEachInBox(lo_W, hi_W,
                             [&](const NearestResult& r) { return boxed.push_back(r.segment), boxed.size() < most; });
        ASSERT_EQ(seen.size(), std::min(most, all.size()));
        ASSERT_EQ(hit.size(), std::min(most, hits.size()));
        ASSERT_EQ(boxed.size(), std::min(most, in_box.size()));
        for (std::size_t i = 0; i < seen.size(); ++i) EXPECT_EQ(seen[i], all[i].segment);
        for (std::size_t i = 0; i < hit.size(); ++i) EXPECT_EQ(hit[i], hits[i].segment);
        std::sort(boxed.begin(), boxed.end());
        EXPECT_EQ(std::unique(boxed.begin(), boxed.end()), boxed.end()) << "once each";
        for (std::size_t i = 0; i < boxed.size(); ++i) {
          if (most == SIZE_MAX) EXPECT_EQ(boxed[i], in_box[i].segment);
        }
      }
    }
  }
}

TEST(Nearest, CountsStandBesideNoResult) {
  const std::vector<Cell> cells = test::randomColumn(23, 12, 600, 300);
  const auto store = storeOf(cells, 16);
  const Nearest nearest(*store);
  std::vector<NearestResult> found;
  const Vector3d h_W =
      store->grid().toWorld(test::snappedSegments(cells, store->grid())[0].child) + Vector3d::Constant(1e-3);
  const SearchCounts counts = nearest.find(h_W, {.max_distance_um = 0}, found);
  EXPECT_TRUE(found.empty());
  EXPECT_GT(counts.tiles_read, 0u);
}

TEST(Nearest, FindsAllInABoxAsBruteForceDoes) {
  for (const test::NamedCells& named : test::worstCases()) {
    SCOPED_TRACE(named.name + ", seed 42");
    const auto store = storeOf(named.cells, 50);
    const auto segments = test::snappedSegments(named.cells, store->grid());
    std::mt19937_64 random(42);
    for (const TileEngineKind engine : {TileEngineKind::packed, TileEngineKind::cgal}) {
      const Nearest nearest(*store, {.engine = engine});
      for (int i = 0; i < 8 && !segments.empty(); ++i) {
        const StoredSegment& some = segments[random() % segments.size()];
        const std::int64_t reach = i == 0 ? 0 : std::int64_t{1} << (2 * i + 2);
        const GridBox box{some.child.array() - reach, some.child.array() + reach};
        std::vector<SegmentId> expected;
        for (const StoredSegment& s : segments)
          if (segmentMeetsBox(s.child, s.parent, box)) expected.push_back(s.id);
        std::vector<SegmentId> found;
        double last = 0;
        for (const NearestResult& r : nearest.inBox(store->grid().toWorld(box.lo), store->grid().toWorld(box.hi))) {
          EXPECT_LE(last, r.distance_um);
          last = r.distance_um;
          found.push_back(r.segment);
        }
        std::sort(expected.begin(), expected.end());
        std::sort(found.begin(), found.end());
        EXPECT_EQ(found, expected);
        const Vector3d lo_W = store->grid().toWorld(box.lo), hi_W = store->grid().toWorld(box.hi);
        std::map<std::uint32_t, std::uint64_t> counts;
        for (const SegmentId& id : expected) ++counts[id.cell];
        EXPECT_EQ(nearest.countInBox(lo_W, hi_W), counts);
        counts.clear();
        for (const StoredSegment& s : segments)
          if (const GridPoint m = midpoint(s.child, s.parent);
              (m.array() >= box.lo.array()).all() && (m.array() < box.hi.array()).all())
            ++counts[s.id.cell];
        EXPECT_EQ(nearest.countInBox(lo_W, hi_W, true), counts);
        // In parts: few segments at once, and a tile at once.
        for (const std::size_t most : {std::size_t{1} + expected.size() / 3, SIZE_MAX}) {
          std::vector<SegmentId> parts;
          for (std::optional<BoxPlace> place = BoxPlace{}; place;) {
            const BoxPart part = nearest.partOfBox(store->grid().toWorld(box.lo), store->grid().toWorld(box.hi), *place,
                                                   most, [] { return true; });
            EXPECT_LE(part.results.size(), most);
            for (const NearestResult& r : part.results) parts.push_back(r.segment);
            place = part.next;
          }
          std::sort(parts.begin(), parts.end());
          EXPECT_EQ(parts, expected);
        }
      }
    }
  }
}

TEST(Nearest, FindsWhatARayHitsAsBruteForceDoes) {
  for (const test::NamedCells& named : test::worstCases()) {
    SCOPED_TRACE(named.name + ", seed 43");
    const auto store = storeOf(named.cells, 50);
    const auto segments = test::snappedSegments(named.cells, store->grid());
    std::mt19937_64 random(43);
    std::normal_distribution<double> normal;
    for (const TileEngineKind engine : {TileEngineKind::packed, TileEngineKind::cgal}) {
      const Nearest nearest(*store, {.engine = engine});
      for (int i = 0; i < 12 && !segments.empty(); ++i) {
        const Vector3d aim_W = store->grid().toWorld(segments[random() % segments.size()].child);
        RayQuery ray{.origin_W = aim_W + 100 * Vector3d(normal(random), normal(random), normal(random)),
                     .direction = {},
                     .radius_um = i % 3 == 0 ? 0.01 : 2.0,
                     .slope = i % 2 == 0 ? 0.0 : 0.02};
        ray.direction = aim_W - ray.origin_W;
        if (i == 0) ray.direction = {0, 0, -3};
        const Vector3d unit = ray.direction / ray.direction.norm();
        std::vector<std::pair<double, SegmentId>> expected;
        for (const StoredSegment& s : segments) {
          const ClosestApproach c =
              closestApproach(store->grid().toWorld(s.child), store->grid().toWorld(s.parent), ray.origin_W, unit);
          if (std::sqrt(c.squared_distance) <= ray.radius_um + ray.slope * c.along)
            expected.emplace_back(c.along, s.id);
        }
        std::sort(expected.begin(), expected.end());
        for (const std::size_t most : {SIZE_MAX, std::size_t{3}, std::size_t{0}}) {
          ray.most = most;
          const std::vector<RayHit> hits = nearest.alongRay(ray);
          ASSERT_EQ(hits.size(), std::min(most, expected.size()));
          for (std::size_t r = 0; r < hits.size(); ++r) {
            EXPECT_EQ(hits[r].segment, expected[r].second);
            EXPECT_EQ(hits[r].along_um, expected[r].first);
          }
        }
      }
    }
  }
}

TEST(Nearest, RefusesImpossibleBoxesAndRays) {
  const auto store = storeOf({test::randomNeuron(1)}, 64);
  const Nearest nearest(*store);
  EXPECT_THROW(nearest.inBox({0, 0, 0}, {1, -1, 1}), UsageError);
  EXPECT_THROW(nearest.inBox({0, 0, 0}, {1, std::nan(""), 1}), UsageError);
  EXPECT_THROW(nearest.alongRay({.origin_W = {0, 0, 0}, .direction = {0, 0, 0}}), UsageError);
  EXPECT_THROW(nearest.alongRay({.origin_W = {0, 0, 0}, .direction = {0, 0, 1}, .radius_um = -1}), UsageError);
}

TEST(Nearest, WarmJumpNeitherAllocatesNorLocks) {
  const std::vector<Cell> cells = test::randomColumn(38, 12, 400, 300);
  const auto store = storeOf(cells, 16);
  const auto points = probes(test::snappedSegments(cells, store->grid()), store->grid(), 98, 30);
  const Nearest nearest(*store);
  std::vector<NearestResult> results;
  for (const Vector3d& h_W : points) nearest.find(h_W, {}, results);
  test::NoAllocGuard guard;
  for (const Vector3d& h_W : points) nearest.find(h_W, {}, results);
  const test::ForbiddenCalls calls = guard.calls();
  EXPECT_EQ(calls.total(), 0u) << calls.first;
}

TEST(Nearest, ServesManyThreads) {
  const std::vector<Cell> cells = test::randomColumn(37, 12, 400, 300);
  const auto store = storeOf(cells, 16);
  const auto segments = test::snappedSegments(cells, store->grid());
  const auto points = probes(segments, store->grid(), 99, 8);
  std::vector<SegmentId> expected;
  for (const Vector3d& h_W : points)
    expected.push_back(test::bruteForceNearest(segments, store->grid(), h_W, 1)[0].segment);
  const test::CountingStore few(*store, kLandmarks);
  const Nearest nearest(few, {.budget_bytes = 100000});
  std::vector<int> wrong(4, 0);
  std::vector<std::thread> threads;
  for (std::size_t t = 0; t < wrong.size(); ++t)
    threads.emplace_back([&, t] {
      for (std::size_t i = 0; i < points.size(); ++i) wrong[t] += nearest.find(points[i]).at(0).segment != expected[i];
    });
  for (std::thread& thread : threads) thread.join();
  for (const int w : wrong) EXPECT_EQ(w, 0);
}

}  // namespace
}  // namespace filiform
