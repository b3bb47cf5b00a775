// densityOf(): each box holds the length that brute force finds there, and all together that of the neurites.
#include "index/measure/neurite_density.h"

#include "index/count_text.h"
#include "index/errors.h"
#include "index/measure/set_measures.h"
#include "tests/support/scenes/memory_store.h"
#include "tests/support/scenes/random_cells.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <random>
#include <tuple>
#include <utility>

#include <gtest/gtest.h>

namespace filiform {
namespace {

std::vector<Cell> columnOfThreeTypes() {
  std::vector<Cell> cells = test::randomColumn(71, 9, 300, 120);
  std::mt19937_64 random(72);  // the seed of types
  for (Cell& cell : cells) {
    std::uint16_t type = 3;
    for (std::uint16_t& of_sample : cell.types) {
      if (random() % 20 == 0) type = static_cast<std::uint16_t>(1 + random() % 4);
      of_sample = type;
    }
  }
  return cells;
}

// The part of a segment in a closed box, um, by clipping at each pair of planes.
double lengthIn(const Vector3d& a, const Vector3d& b, const Vector3d& lo, const Vector3d& hi) {
  double from = 0, to = 1;
  for (int i = 0; i < 3; ++i) {
    const double d = b[i] - a[i];
    if (d == 0) {
      if (a[i] < lo[i] || a[i] >= hi[i]) return 0;  // a piece on a plane counts to the upper box
      continue;
    }
    from = std::max(from, std::min((lo[i] - a[i]) / d, (hi[i] - a[i]) / d));
    to = std::min(to, std::max((lo[i] - a[i]) / d, (hi[i] - a[i]) / d));
  }
  return to > from ? (to - from) * (b - a).norm() : 0;
}

double sumOf(const NeuriteDensity& density) {
  return std::accumulate(density.lengths_um.begin(), density.lengths_um.end(), 0.0);
}

double measuredLength(const TileStore& store, const std::vector<std::uint32_t>& cells) {
  double length_um = 0;
  measureCells(store, cells, {.measures = {}},
               [&](std::uint32_t, const CellMeasures& m) { length_um += m.all.length_um; });
  return length_um;
}

TEST(NeuriteDensity, BoxesHoldWhatBruteForceFinds) {
  const std::vector<Cell> cells = columnOfThreeTypes();
  const auto store = test::storeOf(cells, 50);
  const Grid grid = store->grid();
  for (const double step_um : {61.7, 128.0}) {
    for (const std::vector<std::uint16_t>& types : {std::vector<std::uint16_t>(), {2, 4}}) {
      SCOPED_TRACE(step_um);
      const NeuriteDensity density = densityOf(*store, {.step_um = step_um, .types = types});
      ASSERT_EQ(density.lengths_um.size(), density.boxes[0] * density.boxes[1] * density.boxes[2]);
      std::size_t box = 0;
      for (std::size_t x = 0; x < density.boxes[0]; ++x)
        for (std::size_t y = 0; y < density.boxes[1]; ++y)
          for (std::size_t z = 0; z < density.boxes[2]; ++z) {
            const Vector3d lo = density.corner_um(x, y, z), hi = density.corner_um(x + 1, y + 1, z + 1);
            double expected = 0;
            for (const Cell& cell : cells)
              for (std::uint32_t i = 0; i < cell.types.size(); ++i) {
                const std::uint32_t parent = cell.parents[i];
                if (parent == kNoParent || cell.types[i] == 1 || cell.types[parent] == 1) continue;
                if (!types.empty() && std::find(types.begin(), types.end(), cell.types[i]) == types.end()) continue;
                expected += lengthIn(grid.toWorld(grid.snap(cell.positions_um[i])),
                                     grid.toWorld(grid.snap(cell.positions_um[parent])), lo, hi);
              }
            EXPECT_NEAR(density.lengths_um[box++], expected, 1e-9 * (1 + expected)) << x << ' ' << y << ' ' << z;
          }
    }
  }
}

TEST(NeuriteDensity, LengthsAddUpToThoseOfTheNeurites) {
  std::vector<test::NamedCells> scenes = test::worstCases();
  scenes.push_back({"column", columnOfThreeTypes()});
  for (const test::NamedCells& named : scenes) {
    SCOPED_TRACE(named.name);
    const auto store = test::storeOf(named.cells, 20);
    std::vector<std::uint32_t> all(store->cell_count());
    std::iota(all.begin(), all.end(), 0);
    double reach_um = 1;
    for (const std::uint32_t cell : all)
      if (const GridBox box = store->cell(cell).bounds; !box.empty())
        reach_um = std::max({reach_um, store->grid().toWorld(box.lo).cwiseAbs().maxCoeff(),
                             store->grid().toWorld(box.hi).cwiseAbs().maxCoeff()});
    for (const double step_um : {reach_um / 20, reach_um / 3.7}) {
      const double expected = measuredLength(*store, all);
      const NeuriteDensity density = densityOf(*store, {.step_um = step_um});
      EXPECT_NEAR(sumOf(density), expected, 1e-9 * expected);
      EXPECT_EQ(densityOf(*store, {.step_um = step_um, .threads = 3}).lengths_um, density.lengths_um);
    }
  }
}

TEST(NeuriteDensity, GroupsAreWhatEachCellAndTypeHasAlone) {
  const auto store = test::storeOf(columnOfThreeTypes(), 50);
  const NeuriteDensity all = densityOf(*store, {.step_um = 61.7, .by_cell = true, .by_type = true});
  EXPECT_TRUE(densityOf(*store, {.step_um = 61.7}).groups.empty());
  std::vector<double> by_box(all.lengths_um.size());
  std::map<std::pair<std::uint32_t, std::uint16_t>, double> sums;
  for (std::size_t i = 0; i < all.groups.size(); ++i) {
    const DensityGroup& group = all.groups[i];
    EXPECT_GT(group.length_um, 0);
    by_box[group.box] += group.length_um;
    sums[{group.cell, group.type}] += group.length_um;
    if (i > 0) {
      EXPECT_LT(std::tie(all.groups[i - 1].box, all.groups[i - 1].cell, all.groups[i - 1].type),
                std::tie(group.box, group.cell, group.type));
    }
  }
  for (std::size_t box = 0; box < by_box.size(); ++box) EXPECT_NEAR(by_box[box], all.lengths_um[box], 1e-6);
  EXPECT_GT(sums.size(), store->cell_count());
  for (const auto& [group, sum] : sums)
    EXPECT_NEAR(sum, sumOf(densityOf(*store, {.step_um = 61.7, .cells = {{group.first}}, .types = {group.second}})),
                1e-6);
  const NeuriteDensity by_type = densityOf(*store, {.step_um = 61.7, .by_type = true});
  EXPECT_LT(by_type.groups.size(), all.groups.size());
  const DensityOptions coarse{.step_um = 1000, .by_cell = true, .by_type = true};
  const std::size_t groups = densityOf(*store, coarse).groups.size();
  EXPECT_THROW(densityOf(*store, {.step_um = 1000, .by_cell = true, .by_type = true, .most_boxes = groups - 1}),
               UsageError);
}

TEST(NeuriteDensity, SegmentsOnPlanesCountToTheUpperBox) {
  Cell cell;
  std::uint32_t last = test::addSample(cell, {10, 10, -25});
  last = test::addSample(cell, {10, 10, 5}, last);  // along an edge of boxes
  last = test::addSample(cell, {-10, 10, 5}, last);
  test::addSample(cell, {-10, 0, 5}, last);
  cell.name = "edge";
  const auto store = test::storeOf({cell});
  const NeuriteDensity density = densityOf(*store, {.step_um = 10});
  EXPECT_EQ(density.first, (std::array<std::int64_t, 3>{-1, 0, -3}));
  EXPECT_EQ(density.boxes, (std::array<std::size_t, 3>{3, 2, 4}));
  const auto at = [&](std::size_t x, std::size_t y, std::size_t z) { return density.lengths_um[(x * 2 + y) * 4 + z]; };
  EXPECT_DOUBLE_EQ(at(2, 1, 0), 5);
  EXPECT_DOUBLE_EQ(at(2, 1, 1), 10);
  EXPECT_DOUBLE_EQ(at(2, 1, 2), 10);
  EXPECT_DOUBLE_EQ(at(2, 1, 3), 5);
  EXPECT_DOUBLE_EQ(at(1, 1, 3), 10);
  EXPECT_DOUBLE_EQ(at(0, 1, 3), 10);
  EXPECT_DOUBLE_EQ(at(0, 0, 3), 10);
  EXPECT_DOUBLE_EQ(sumOf(density), 60);
}

TEST(NeuriteDensity, CellsAreChosen) {
  const auto store = test::storeOf(columnOfThreeTypes(), 50);
  const std::vector<std::uint32_t> some{1, 4};
  const double expected = measuredLength(*store, some);
  EXPECT_NEAR(sumOf(densityOf(*store, {.step_um = 20, .cells = some})), expected, 1e-9 * expected);
  EXPECT_TRUE(densityOf(*store, {.step_um = 20, .cells = std::vector<std::uint32_t>()}).lengths_um.empty());
}

TEST(NeuriteDensity, WrongGridsAreRefusedWithTheirSize) {
  const auto store = test::storeOf(columnOfThreeTypes(), 50);
  for (const double wrong : {0.0, -1.0, std::nan(""), HUGE_VAL})
    EXPECT_THROW(densityOf(*store, {.step_um = wrong}), UsageError) << wrong;
  const NeuriteDensity density = densityOf(*store, {.step_um = 20});
  try {
    densityOf(*store, {.step_um = 20, .most_boxes = density.lengths_um.size() - 1});
    FAIL();
  } catch (const UsageError& error) {
    EXPECT_NE(std::string(error.what()).find(formatCount(density.lengths_um.size())), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("larger step"), std::string::npos);
  }
  EXPECT_THROW(densityOf(*store, {.step_um = 1e-300}), UsageError);
}

}  // namespace
}  // namespace filiform
