#include "index/compare/cell_change.h"

#include "tests/support/scenes/memory_store.h"
#include "tests/support/scenes/random_cells.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

namespace filiform {
namespace {

CellGraph gridGraphOf(const Cell& cell, int exponent = Grid::kDefaultExponent) {
  CellList stream({cell});
  return readCell(*buildTilesInMemory(stream, {.capacity = 50, .quantum_exponent = exponent}), 0, true);
}

CellChange changeOf(const Cell& a, const Cell& b) { return compareCells(gridGraphOf(a), gridGraphOf(b)); }

TEST(CellChange, ASampleAtItsPlaceIsTheSame) {
  const Cell cell = test::randomNeuron(1);
  EXPECT_EQ(changeOf(cell, cell).kind, CellFate::kSame);
  Cell renamed = cell;
  renamed.name = "another";
  renamed.header = "# more";
  for (std::int64_t& id : renamed.sample_ids) id += 1000;
  EXPECT_EQ(changeOf(cell, renamed).kind, CellFate::kSame) << "names, headers and ids do not count";
  for (const test::NamedCells& named : test::worstCases())
    for (const Cell& one : named.cells) EXPECT_EQ(changeOf(one, one).kind, CellFate::kSame) << named.name;
}

TEST(CellChange, TheOrderOfSamplesAndTheDirectionOfLinksDoNotCount) {
  const Cell cell = test::randomNeuron(2, {.extra_root = 0});
  Cell turned;  // from the last sample on
  std::vector<std::array<std::uint32_t, 2>> edges;
  const auto last = static_cast<std::uint32_t>(cell.samples() - 1);
  for (std::uint32_t i = 0; i <= last; ++i) {
    test::addSample(turned, cell.positions_um[last - i], kNoParent, cell.radii_um[last - i], cell.types[last - i]);
    if (cell.parents[i] != kNoParent) edges.push_back({last - i, last - cell.parents[i]});
  }
  connect(turned, std::move(edges));
  EXPECT_EQ(changeOf(cell, turned).kind, CellFate::kSame);
}

TEST(CellChange, AMovedCellSaysByHowMuch) {
  const Cell cell = test::randomNeuron(3);
  Cell moved = cell;
  for (Vector3d& p : moved.positions_um) p += Vector3d(3.0001, -4.0003, 0);
  CellChange change = changeOf(cell, moved);
  EXPECT_EQ(change.kind, CellFate::kMoved);
  EXPECT_NEAR(change.moved_um, 5, 0.01);
  EXPECT_EQ(change.turned_rad, 0);

  const Eigen::AngleAxisd turn(0.7, Vector3d(1, 2, -1).normalized());
  for (std::size_t i = 0; i < cell.samples(); ++i)
    moved.positions_um[i] = cell.positions_um[0] + turn * (cell.positions_um[i] - cell.positions_um[0]);
  change = changeOf(cell, moved);
  EXPECT_EQ(change.kind, CellFate::kMoved);
  EXPECT_NEAR(change.moved_um, 0, 0.01);
  EXPECT_NEAR(change.turned_rad, 0.7, 1e-4);

  for (Vector3d& p : moved.positions_um) p.x() = -p.x();
  EXPECT_EQ(changeOf(cell, moved).kind, CellFate::kChanged) << "a mirror image is another shape";
  moved = cell;
  for (Vector3d& p : moved.positions_um) p = 1.01 * p + Vector3d(50, 0, 0);
  EXPECT_EQ(changeOf(cell, moved).kind, CellFate::kChanged) << "and so is a larger one";
  Cell one = cell;
  one.positions_um[40].y() += 0.01;
  EXPECT_EQ(changeOf(cell, one).kind, CellFate::kChanged) << "one sample";
  one = cell;
  one.positions_um[40].y() += 1.0 / 512;
  const CellChange least = changeOf(cell, one);
  EXPECT_EQ(least.kind, CellFate::kChanged) << "by one quantum";
  EXPECT_EQ(least.samples_added, 1u);
  EXPECT_EQ(least.samples_removed, 1u);
}

TEST(CellChange, AnotherGridIsNoChange) {
  const Cell cell = test::randomNeuron(4);
  EXPECT_EQ(compareCells(gridGraphOf(cell), gridGraphOf(cell, -4)).kind, CellFate::kSame);
  EXPECT_EQ(compareCells(gridGraphOf(cell, 1), gridGraphOf(cell)).kind, CellFate::kSame);
  Cell moved = cell;
  for (Vector3d& p : moved.positions_um) p.z() += 30;
  const CellChange change = compareCells(gridGraphOf(cell), gridGraphOf(moved, -4));
  EXPECT_EQ(change.kind, CellFate::kMoved);
  EXPECT_NEAR(change.moved_um, 30, 0.1);
}

TEST(CellChange, CountsSamplesAndSegments) {
  const Cell cell = test::randomNeuron(5, {.samples = 200, .extra_root = 0});
  // A new twig of three samples.
  Cell grown = cell;
  std::uint32_t tip = 17;
  for (int i = 0; i < 3; ++i) tip = test::addSample(grown, Vector3d(500 + i, 0, 0), tip);
  CellChange change = changeOf(cell, grown);
  EXPECT_EQ(change.kind, CellFate::kChanged);
  EXPECT_EQ(change.samples_added, 3u);
  EXPECT_EQ(change.segments_added, 3u);
  EXPECT_EQ(change.samples_removed + change.segments_removed + change.samples_edited, 0u);
  change = changeOf(grown, cell);
  EXPECT_EQ(change.samples_removed, 3u);
  EXPECT_EQ(change.segments_removed, 3u);
  EXPECT_EQ(change.samples_added + change.segments_added + change.samples_edited, 0u);

  Cell edited = cell;
  edited.radii_um[3] += 1;
  edited.types[9] = 7;
  change = changeOf(cell, edited);
  EXPECT_EQ(change.kind, CellFate::kChanged);
  EXPECT_EQ(change.samples_edited, 2u);
  EXPECT_EQ(change.samples_added + change.samples_removed + change.segments_added + change.segments_removed, 0u);

  Cell cut = cell;  // one link less
  cut.parents[50] = kNoParent;
  change = changeOf(cell, cut);
  EXPECT_EQ(change.segments_removed, 1u);
  EXPECT_EQ(change.samples_added + change.samples_removed + change.samples_edited + change.segments_added, 0u);
  EXPECT_LT(lengthOf_um(gridGraphOf(cut)), lengthOf_um(gridGraphOf(cell)));
}

TEST(CellChange, CountsSamplesAtOnePlaceOneByOne) {
  Cell two, three;
  for (Cell* cell : {&two, &three}) test::addSample(*cell, Vector3d(1, 1, 1));
  for (int i = 0; i < 2; ++i) test::addSample(two, Vector3d::Zero(), 0, 1);
  for (int i = 0; i < 3; ++i) test::addSample(three, Vector3d::Zero(), 0, i < 1 ? 1.f : 2.f);
  const CellChange change = changeOf(two, three);
  EXPECT_EQ(change.samples_edited, 1u);
  EXPECT_EQ(change.samples_added, 1u);
  EXPECT_EQ(change.samples_removed, 0u);
  EXPECT_EQ(change.segments_added, 1u);
}

}  // namespace
}  // namespace filiform
