#include "viewer/scene/neurite_batches.h"

#include "index/errors.h"
#include "tests/support/scenes/memory_store.h"
#include "tests/support/scenes/random_cells.h"

#include <cmath>
#include <map>
#include <tuple>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::storeOf;

Vector3d endOf(const NeuriteBatch& batch, const float* p_um) {
  return batch.origin_W + Vector3d(p_um[0], p_um[1], p_um[2]);
}

// For any tiling, each link of each cell is drawn once, at its place and as thick as its samples.
TEST(NeuriteBatches, DrawEveryLinkOnce) {
  std::vector<Cell> cells = test::randomColumn(5, 3, 400, 300);
  for (Cell& cell : cells)
    for (std::size_t i = 0; i < cell.samples(); ++i) cell.radii_um[i] = 0.1F + 0.001F * static_cast<float>(i);
  const auto store = storeOf(cells, 64);
  ASSERT_GT(store->tile_count(), 10u);

  using Ends = std::tuple<std::int64_t, std::int64_t, std::int64_t, std::int64_t, std::int64_t, std::int64_t>;
  const auto key = [&](const Vector3d& a, const Vector3d& b) {
    const GridPoint p = store->grid().snap(a), q = store->grid().snap(b);
    return Ends{p.x(), p.y(), p.z(), q.x(), q.y(), q.z()};
  };
  std::map<Ends, int> drawn;
  std::map<Ends, float> radius;
  std::size_t unequal = 0, segments = 0;
  for (TileId id = 0; id < store->tile_count(); ++id) {
    const NeuriteBatch batch = makeBatch(*store->load(id), store->loadAppearance(id));
    EXPECT_EQ(batch.segments.size(), store->entry(id).owned);
    for (const DrawnSegment& s : batch.segments) {
      const Vector3d a = endOf(batch, s.a_um), b = endOf(batch, s.b_um);
      ++drawn[key(a, b)];
      radius[key(a, b)] = s.a_radius_um;
      EXPECT_TRUE((a.array() >= batch.lo_W.array()).all() && (b.array() <= batch.hi_W.array()).all());
      EXPECT_LE(s.b_radius_um, batch.largest_radius_um);
      unequal += s.a_radius_um != s.b_radius_um;
      ++segments;
    }
  }
  for (const Cell& cell : cells)
    for (std::uint32_t i = 0; i < cell.samples(); ++i) {
      const auto [child, parent] = cell.ends(i);
      if (child == parent) continue;
      const Ends ends = key(cell.positions_um[child], cell.positions_um[parent]);
      ASSERT_EQ(drawn[ends], 1);
      EXPECT_FLOAT_EQ(radius[ends], cell.radii_um[child]);
    }
  EXPECT_GT(unequal, segments / 2);
}

TEST(NeuriteBatches, StayExactFarFromTheOrigin) {
  test::NeuronShape shape;
  shape.origin_W = Vector3d(8e8, -7e8, 9e8);
  const Cell cell = test::randomNeuron(3, shape);
  const auto store = storeOf({cell}, 4096);
  double worst_um = 0;
  for (TileId id = 0; id < store->tile_count(); ++id) {
    const auto tile = store->load(id);
    const NeuriteBatch batch = makeBatch(*tile, store->loadAppearance(id));
    std::size_t i = 0;
    for (std::uint32_t s = 0; s < tile->segment_count(); ++s) {
      if (!tile->owned(s)) continue;
      worst_um = std::max(worst_um, (endOf(batch, batch.segments[i++].a_um) - tile->position_W(tile->child(s))).norm());
    }
  }
  EXPECT_LT(worst_um, 1e-3);  // floats of the world's coordinates would be off by 64 um
}

TEST(NeuriteBatches, ImplausibleRadiiAreReplacedAndCounted) {
  for (const float wrong : {kUnknownRadius, 0.F, -1.F, 500.F, 1e-6F, 1e30F}) {
    bool replaced = false;
    EXPECT_EQ(drawnRadius(wrong, 3, &replaced), kDrawnUnknown_um);
    EXPECT_TRUE(replaced);
    EXPECT_EQ(drawnRadius(wrong, 1, &replaced), kDrawnUnknownSoma_um);
    EXPECT_TRUE(replaced);
  }
  bool replaced = true;
  EXPECT_EQ(drawnRadius(2.5F, 3, &replaced), 2.5F);
  EXPECT_FALSE(replaced);
  EXPECT_EQ(drawnRadius(20, 1), 20);
  EXPECT_EQ(drawnRadius(20, 3), kDrawnUnknown_um);

  Cell cell;
  const auto root = test::addSample(cell, {0, 0, 0});
  const auto a = test::addSample(cell, {10, 0, 0}, root, 700);
  test::addSample(cell, {20, 0, 0}, a, 1);
  const auto store = storeOf({cell}, 100);
  EXPECT_EQ(makeBatch(*store->load(0), store->loadAppearance(0)).implausible_radii, 1u);
}

TEST(NeuriteBatches, SomataAreBallsAndDoNotThickenTheirNeurites) {
  Cell cell;
  const auto soma = test::addSample(cell, {0, 0, 0}, kNoParent, 8, 1);
  for (const double x : {30.0, -30.0}) test::addSample(cell, {x, 5, 0}, soma, 1.5F, 3);
  const auto store = storeOf({cell}, 100);
  RootTable roots;
  addRoots(*store, 0, roots);
  ASSERT_EQ(roots.size(), 1u);
  const NeuriteBatch with = makeBatch(*store->load(0), store->loadAppearance(0), {.roots = &roots});
  ASSERT_EQ(with.segments.size(), 3u);
  int balls = 0;
  for (const DrawnSegment& s : with.segments) {
    if (std::equal(s.a_um, s.a_um + 3, s.b_um)) {
      ++balls;
      EXPECT_EQ(s.a_radius_um, 8);
      EXPECT_LT(endOf(with, s.a_um).norm(), 1e-5);
    } else {
      EXPECT_EQ(s.b_radius_um, 1.5F);
    }
  }
  EXPECT_EQ(balls, 1);
  EXPECT_EQ(makeBatch(*store->load(0), store->loadAppearance(0)).segments.size(), 2u);
}

TEST(NeuriteBatches, WorstCasesGiveFiniteSegments) {
  for (const test::NamedCells& worst : test::worstCases()) {
    SCOPED_TRACE(worst.name);
    const auto store = storeOf(worst.cells, 64);
    RootTable roots;
    for (std::uint32_t cell = 0; cell < store->cell_count(); ++cell) addRoots(*store, cell, roots);
    for (TileId id = 0; id < store->tile_count(); ++id) {
      const NeuriteBatch batch = makeBatch(*store->load(id), store->loadAppearance(id), {.roots = &roots});
      EXPECT_GE(batch.segments.size(), store->entry(id).owned);
      for (const DrawnSegment& s : batch.segments)
        for (int axis = 0; axis < 3; ++axis) EXPECT_TRUE(std::isfinite(s.a_um[axis]) && std::isfinite(s.b_um[axis]));
    }
  }
}

TEST(NeuriteBatches, BallsComeFirstThenTheThickest) {
  NeuriteBatch batch;
  for (const float radius_um : {1.0F, 3.0F, 2.0F}) {
    batch.segments.push_back({{1, 2, 3}, radius_um, {1, 2, 4}, 0, {}});
    batch.segments.push_back({{1, 2, 3}, radius_um, {1, 2, 3}, radius_um, {}});
  }
  EXPECT_FALSE(isSortedForDrawing(batch));
  sortForDrawing(batch);
  EXPECT_TRUE(isSortedForDrawing(batch));
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(isBall(batch.segments[i]), i < 3);
    EXPECT_EQ(batch.segments[i].a_radius_um, static_cast<float>(3 - i % 3));
  }
}

TEST(NeuriteBatches, ThickestComeFirstAndBatchesJoin) {
  const auto store = storeOf(test::randomColumn(5, 3, 200, 300), 64);
  NeuriteBatch all = makeBatch(*store->load(0), store->loadAppearance(0));
  const NeuriteBatch first = all, second = makeBatch(*store->load(1), store->loadAppearance(1));
  append(all, second);
  ASSERT_EQ(all.segments.size(), first.segments.size() + second.segments.size());
  const Vector3d have = endOf(all, all.segments.back().a_um), want = endOf(second, second.segments.back().a_um);
  EXPECT_LT((have - want).norm(), 1e-3);
  EXPECT_TRUE((all.hi_W.array() >= second.hi_W.array()).all());
  for (std::size_t i = 0; i < all.segments.size(); ++i) all.segments[i].b_radius_um = 0.1F * static_cast<float>(i % 7);
  EXPECT_FALSE(isSortedForDrawing(all));
  sortForDrawing(all);
  EXPECT_TRUE(isSortedForDrawing(all));
}

TEST(NeuriteBatches, OneCellAlone) {
  const auto store = storeOf(test::randomColumn(5, 3, 200, 30), 4096);
  std::size_t sum = 0;
  for (std::uint32_t cell = 0; cell < 3; ++cell)
    sum += makeBatch(*store->load(0), store->loadAppearance(0), {.only_cell = cell}).segments.size();
  ASSERT_EQ(store->tile_count(), 1u);
  EXPECT_EQ(sum, store->entry(0).owned);
}

// A node is closed if it is the child end of a segment. A root is always open.
TEST(NeuriteBatches, OpenNodesAreRootsAndWhatComesFromOutside) {
  Cell cell;
  const std::uint32_t root = test::addSample(cell, {0, 0, 0}, kNoParent, 5, 1);
  test::addSample(cell, {10, 0, 0}, root);
  const auto store = storeOf({cell}, 4096);
  EXPECT_EQ(cellsWithOpenNodes(*store->load(0)), std::vector<std::uint32_t>{0});
}

}  // namespace
}  // namespace filiform
