#include "solver/proxy/parameters.h"

#include "index/ingest/memory_tiles.h"
#include "tests/support/scenes/random_cells.h"

#include <algorithm>
#include <random>

#include <gtest/gtest.h>

namespace filiform::test {
namespace {

TEST(AutomaticParameters, AreThe5thAnd95thPercentileByNearestRank) {
  std::vector<double> lengths_um;
  for (int i = 1; i <= 100; ++i) lengths_um.push_back(i);
  std::mt19937_64 random(1);
  std::shuffle(lengths_um.begin(), lengths_um.end(), random);
  const SolverParameters parameters = automaticParameters(lengths_um);
  EXPECT_EQ(parameters.r_min_um, 5.0);
  EXPECT_EQ(parameters.r_max_um, 95.0);
  EXPECT_EQ(parameters.gain, 1.0);
  EXPECT_EQ(parameters.max_visited, SolverParameters{}.max_visited);
}

TEST(AutomaticParameters, IgnoreZeroLengthsAndOneLongSegment) {
  std::vector<double> lengths_um(1000, 2.0);
  lengths_um.insert(lengths_um.end(), 500, 0.0);
  lengths_um.push_back(700.0);
  const SolverParameters parameters = automaticParameters(lengths_um);
  EXPECT_EQ(parameters.r_min_um, 2.0);
  EXPECT_EQ(parameters.r_max_um, 2.0);
}

TEST(AutomaticParameters, OfFewLengths) {
  EXPECT_EQ(automaticParameters(std::vector<double>{}).r_max_um, 0.0);
  EXPECT_EQ(automaticParameters(std::vector<double>{0.0, 0.0}).r_max_um, 0.0);
  const SolverParameters one = automaticParameters(std::vector<double>{3.5});
  EXPECT_EQ(one.r_min_um, 3.5);
  EXPECT_EQ(one.r_max_um, 3.5);
  const SolverParameters two = automaticParameters(std::vector<double>{4.0, 1.0});
  EXPECT_EQ(two.r_min_um, 1.0);
  EXPECT_EQ(two.r_max_um, 4.0);
}

TEST(AutomaticParameters, OfACellAreThoseOfItsTiles) {
  const std::vector<Cell> cells = randomColumn(3, 5, 400, 50.0);
  for (const std::uint32_t capacity : {16u, 2048u}) {
    CellList stream(cells);
    const std::unique_ptr<TileStore> store = buildTilesInMemory(stream, {.capacity = capacity});
    for (std::uint32_t cell = 0; cell < store->cell_count(); ++cell) {
      const SolverParameters from_tiles = automaticParameters(*store, cell);
      const SolverParameters from_cell = automaticParameters(cells[cell], store->grid());
      EXPECT_EQ(from_tiles.r_min_um, from_cell.r_min_um);
      EXPECT_EQ(from_tiles.r_max_um, from_cell.r_max_um);
      EXPECT_GT(from_tiles.r_min_um, 0.0);
      EXPECT_GT(from_tiles.r_max_um, from_tiles.r_min_um);
    }
  }
}

}  // namespace
}  // namespace filiform::test
