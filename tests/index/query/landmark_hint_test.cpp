#include "index/query/internal/landmark_hint.h"

#include "tests/support/scenes/brute_force.h"
#include "tests/support/scenes/counting_store.h"
#include "tests/support/scenes/memory_store.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/scenes/tile_invariants.h"

#include <cmath>
#include <limits>
#include <random>
#include <set>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::storeOf;

// A store with other landmarks.
class LandmarkStore : public test::CountingStore {
 public:
  LandmarkStore(const TileStore& store, Landmarks landmarks) : CountingStore(store), landmarks_(std::move(landmarks)) {}
  const Landmarks& landmarks() const override { return landmarks_; }

 private:
  Landmarks landmarks_;
};

TEST(LandmarkHint, FewLandmarksAreEnough) {
  const auto store = storeOf(test::randomColumn(1, 2, 100, 50), 100);
  for (const std::size_t n : {0, 1, 2, 3, 11}) {
    Landmarks landmarks;
    for (std::size_t i = 0; i < n; ++i) {
      landmarks.points.push_back(GridPoint::Constant(512 * static_cast<std::int64_t>(i)));
      landmarks.segments.push_back({0, static_cast<std::uint32_t>(i)});
      landmarks.t.push_back(0);
    }
    const LandmarkStore store_with_few(*store, landmarks);
    const LandmarkHint hint(store_with_few);
    for (const std::size_t k : {1, 2, 5, 1000}) {
      const auto guesses = hint.nearest(Vector3d(0.25, 0, 0), k);
      ASSERT_EQ(guesses.size(), std::min(n, k));
      for (std::size_t i = 0; i < guesses.size(); ++i) EXPECT_EQ(guesses[i].segment.segment, i);
    }
    EXPECT_TRUE(hint.nearest(Vector3d::Zero(), 0).empty());
  }
}

TEST(LandmarkHint, CoincidentLandmarksOfOneSegmentCountOnce) {
  const auto store = storeOf(test::randomColumn(1, 2, 100, 50), 100);
  Landmarks landmarks;
  for (std::uint32_t i = 0; i < 5000; ++i) {
    landmarks.points.push_back(GridPoint(7, 7, i < 4950 ? 7 : 700));
    landmarks.segments.push_back({0, i < 4950 ? 4 : i});
    landmarks.t.push_back(0);
  }
  const LandmarkStore store_with_few(*store, landmarks);
  const LandmarkHint hint(store_with_few);
  const auto guesses = hint.nearest(Vector3d::Zero(), 3);
  ASSERT_EQ(guesses.size(), 3u);
  EXPECT_EQ(guesses[0].segment.segment, 4u);
  EXPECT_EQ(guesses[1].segment.segment, 4950u);
  EXPECT_EQ(guesses[2].segment.segment, 4951u);
}

TEST(LandmarkHint, TheFirstIsWithinTheCoveringRadius) {
  for (const test::NamedCells& named : test::worstCases()) {
    SCOPED_TRACE(named.name);
    const auto store = storeOf(named.cells, 100);
    const std::vector<StoredSegment> segments = test::snappedSegments(named.cells, store->grid());
    const test::CountingStore store_with_few(*store, 2000);
    const LandmarkHint hint(store_with_few);
    std::mt19937_64 random(2);
    for (int i = 0; i < 20 && !segments.empty(); ++i) {
      std::normal_distribution<double> jitter(0, i < 10 ? 3.0 : 1e4);
      const Vector3d h_W = store->grid().toWorld(segments[random() % segments.size()].child) +
                           Vector3d(jitter(random), jitter(random), jitter(random));
      const double nearest_um = test::bruteForceNearest(segments, store->grid(), h_W, 1)[0].distance_um;
      const auto guesses = hint.nearest(h_W, 7);
      ASSERT_FALSE(guesses.empty());
      EXPECT_LE(guesses[0].distance, (nearest_um + hint.covering_radius_um()) * (1 + 1e-12) + 1e-6);
    }
  }
}

TEST(LandmarkHint, BuildsNothingBeforeTheFirstQuestion) {
  const auto store = storeOf(test::randomColumn(1, 2, 100, 50), 100);
  const test::CountingStore counted(*store, 50);
  const LandmarkHint hint(counted);
  EXPECT_EQ(counted.landmarkReads(), 0u);
  hint.nearest(Vector3d::Zero(), 1);
  hint.nearest(Vector3d::Zero(), 1);
  EXPECT_EQ(counted.landmarkReads(), 1u);
  EXPECT_TRUE(counted.loads().empty());
}

}  // namespace
}  // namespace filiform
