#include "viewer/window/travel/internal/seen_neurite.h"

#include "tests/support/scenes/memory_store.h"
#include "tests/support/scenes/random_cells.h"

#include <gtest/gtest.h>

namespace filiform::internal {
namespace {

// A soma, an axon of two branches, and a longer dendrite.
Cell twoKinds() {
  Cell cell;
  const auto soma = test::addSample(cell, {0, 0, 0}, kNoParent, 5, 1);
  const auto axon = test::addSample(cell, {10, 0, 0}, soma, 1, 2);
  test::addSample(cell, {10, 20, 0}, axon, 0.5F, 2);
  test::addSample(cell, {40, 0, 0}, axon, 2, 2);
  test::addSample(cell, {0, 0, 300}, soma, 1, 3);
  cell.source = "a";
  return cell;
}

TEST(SeenNeurites, NameTypeDistanceRadiusAndTheTipOfTheirKind) {
  const auto store = test::storeOf({twoKinds()}, 64);
  const CellWalk walk(readCell(*store, 0, true));
  const CellWalk::Spot branch = walk.at(1), tip = walk.at(3), dendrite = walk.at(4);
  EXPECT_EQ(kindText(walk, branch), "axon, 10 \u00b5m from the soma");
  EXPECT_EQ(kindText(walk, tip), "axon, 40 \u00b5m from the soma");
  EXPECT_EQ(kindText(walk, dendrite), "basal dendrite, 300 \u00b5m from the soma");
  EXPECT_EQ(farthestTipOfKind(walk, branch), 3u);
  EXPECT_EQ(walk.paths().farthestTip(branch), 4u) << "the farthest of the cell is another one";
  EXPECT_EQ(farthestTipOfKind(walk, tip), 2u);
  EXPECT_EQ(farthestTipOfKind(walk, dendrite), std::nullopt);
  const auto middle = walk.paths().on(tip.segment, 0.5);
  ASSERT_TRUE(middle);
  EXPECT_NEAR(radiusAt_um(walk, *middle), 1.5, 1e-6);
  EXPECT_NEAR(walk.toRoot_um(*middle), 25, 1e-2);
}

TEST(SeenNeurites, TheWayToTheRootIsThePath) {
  const auto store = test::storeOf({test::randomNeuron(7)}, 64);
  const CellWalk walk(readCell(*store, 0, true));
  for (std::uint32_t sample = 0; sample < walk.samples(); sample += 7) {
    const CellWalk::Spot spot = walk.at(sample);
    const auto path_um = walk.paths().length_um(spot, walk.at(walk.root(spot)));
    ASSERT_TRUE(path_um);
    EXPECT_NEAR(walk.toRoot_um(spot), *path_um, 1e-6 * (1 + *path_um)) << sample;
  }
}

}  // namespace
}  // namespace filiform::internal
