#include "index/ingest/growth/internal/removal.h"

#include "index/ingest/memory_tiles.h"
#include "tests/support/scenes/faulty_set.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/temp_folder.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <memory>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace filiform::internal {
namespace {

// A set with this number of landmarks, each on a random cell.
std::unique_ptr<TileSet> setWith(const test::TempFolder& folder, std::size_t landmarks) {
  CellList stream(test::randomColumn(5, 40, 20, 80));
  const auto store = buildTilesInMemory(stream, {.capacity = 50});
  test::Faults faults;
  faults.landmarks = [&](Landmarks& all) {
    std::mt19937_64 random(6);
    std::vector<std::pair<MortonKey, GridPoint>> points;
    for (std::size_t i = 0; i < landmarks; ++i) {
      const auto axis = [&random] { return static_cast<std::int64_t>(random() % 100'000); };
      const GridPoint p(axis(), axis(), i % 100 == 0 ? 10'000'000 + axis() : axis());
      points.emplace_back(mortonKey(p), p);
    }
    std::sort(points.begin(), points.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    all.points.clear();
    all.segments.clear();
    for (const auto& [key, p] : points) {
      all.points.push_back(p);
      all.segments.push_back({static_cast<std::uint32_t>(random() % store->cell_count()), 0});
    }
    all.t.assign(landmarks, 0);
  };
  test::writeFaultySet(*store, folder / "a.fil", faults);
  return TileSet::open(folder / "a.fil");
}

double distanceOfFarthest(const TileSet& set, const std::vector<bool>& removed, const Landmarks& left) {
  double farthest = 0;
  const Landmarks& all = set.landmarks();
  for (std::size_t i = 0; i < all.points.size(); ++i) {
    if (!removed[all.segments[i].cell]) continue;
    double nearest = HUGE_VAL;
    for (const GridPoint& p : left.points)
      nearest = std::min(nearest, (set.grid().toWorld(p) - set.grid().toWorld(all.points[i])).norm());
    farthest = std::max(farthest, nearest);
  }
  return farthest;
}

TEST(Removal, TheCoveringRadiusGrowsByTheDistanceToTheNearestLandmarkThatRemains) {
  const test::TempFolder folder;
  const auto set = setWith(folder, 1500);
  for (const std::uint32_t modulus : {2u, 7u}) {
    std::vector<bool> removed(set->cell_count());
    for (std::uint32_t c = 0; c < removed.size(); ++c) removed[c] = c % modulus == 0;
    const Landmarks left = withoutCells(*set, removed, set->bounds());
    EXPECT_LT(left.points.size(), 1500u);
    EXPECT_NEAR(left.covering_radius_um - set->landmarks().covering_radius_um, distanceOfFarthest(*set, removed, left),
                1e-9);
  }
}

TEST(Removal, RemovingHalfOfManyLandmarksIsNotQuadratic) {
  const auto seconds = [](std::size_t landmarks) {
    const test::TempFolder folder;
    const auto set = setWith(folder, landmarks);
    set->landmarks();
    std::vector<bool> removed(set->cell_count());
    for (std::uint32_t c = 0; c < removed.size(); ++c) removed[c] = c % 2 == 0;
    const auto begin = std::clock();
    withoutCells(*set, removed, set->bounds());
    return static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  };
  // 64 times as much if every removed landmark were compared with every other one.
  EXPECT_LT(seconds(64'000), 30 * std::max(seconds(8'000), 0.001));
}

}  // namespace
}  // namespace filiform::internal
