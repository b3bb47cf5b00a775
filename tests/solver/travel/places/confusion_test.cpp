#include "solver/travel/places/confusion.h"

#include "tests/support/scenes/memory_store.h"
#include "tests/support/scenes/random_cells.h"

#include <memory>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::storeOf;

// Straight neurites of 4 um segments along x, `apart` um from each other in y and z.
std::vector<Cell> bundle(int across, double apart_um) {
  std::vector<Cell> cells;
  for (int i = 0; i < across; ++i)
    for (int j = 0; j < across; ++j) {
      Cell cell;
      for (std::uint32_t s = 0; s < 100; ++s)
        test::addSample(cell, {4.0 * s, apart_um * i, apart_um * j}, s == 0 ? kNoParent : s - 1);
      cell.source = "t" + std::to_string(100 * i + j + 10000) + ".swc";
      cells.push_back(cell);
    }
  return cells;
}

TEST(Confusion, OneNeuriteIsNeverTakenForAnother) {
  const auto store = storeOf({test::longNeurite(2000, 1.0)});
  const Nearest nearest(*store);
  const Confusion confusion(*store, nearest);
  EXPECT_EQ(confusion.places(), 400u);
  // A straight neurite: however large the tremor, the nearest segment lies within its length along the neurite.
  const auto straight = storeOf(bundle(1, 1));
  const Nearest nearest_straight(*straight);
  const Confusion of_straight(*straight, nearest_straight);
  for (const double zoom_um : {1.0, 100.0, 1e4}) EXPECT_EQ(of_straight.at(zoom_um), 0.0) << zoom_um;
  EXPECT_GE(of_straight.largestZoom(), 9e4);
}

TEST(Confusion, OfABundleFollowsFromItsSpacing) {
  for (const double apart_um : {2.0, 8.0}) {
    const auto store = storeOf(bundle(7, apart_um));
    const Nearest nearest(*store);
    const Confusion confusion(*store, nearest);
    // In an infinite square bundle, a place is confused if its tremor exceeds half the spacing in y or z. For a normal
    // deviate, 5 % are confused if half the spacing is 2.24 standard deviations. At the bundle's border there are fewer
    // neighbours.
    const double tremor_um = 0.5 * apart_um / 2.24, zoom_um = tremor_um * 0.12 / 0.0005;
    const double found_um = confusion.largestZoom();
    EXPECT_GT(found_um, 0.8 * zoom_um) << apart_um;
    EXPECT_LT(found_um, 1.45 * zoom_um) << apart_um;
    EXPECT_LE(confusion.at(found_um), 0.05);
    EXPECT_GT(confusion.at(8 * found_um), 0.3);
    EXPECT_EQ(confusion.at(0.01 * found_um), 0.0);
  }
}

TEST(Confusion, IsTheSameForASeedAndDoesNotDependOnTheTiling) {
  const auto cells = test::randomColumn(5, 4, 400, 60);
  const auto coarse = storeOf(cells, 2048), fine = storeOf(cells, 16);
  const Nearest nearest_coarse(*coarse), nearest_fine(*fine);
  ConfusionOptions options;
  options.places = 100;
  const Confusion one(*coarse, nearest_coarse, options), same(*coarse, nearest_coarse, options);
  const Confusion tiled(*fine, nearest_fine, options);
  EXPECT_GT(one.at(3000), 0.0);
  for (const double zoom_um : {100.0, 300.0, 1000.0}) {
    EXPECT_EQ(one.at(zoom_um), same.at(zoom_um));
    if (coarse->landmarks().points == fine->landmarks().points) {
      EXPECT_EQ(one.at(zoom_um), tiled.at(zoom_um));
    }
  }
}

TEST(Confusion, OfAnEmptySetIsZero) {
  const auto store = storeOf({});
  const Nearest nearest(*store);
  const Confusion confusion(*store, nearest);
  EXPECT_EQ(confusion.places(), 0u);
  EXPECT_EQ(confusion.at(300), 0.0);
}

}  // namespace
}  // namespace filiform
