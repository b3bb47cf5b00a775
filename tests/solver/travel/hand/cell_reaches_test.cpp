#include "solver/travel/hand/internal/cell_reaches.h"

#include "index/errors.h"
#include "solver/proxy/parameters.h"
#include "tests/support/scenes/counting_store.h"
#include "tests/support/scenes/memory_store.h"
#include "tests/support/scenes/random_cells.h"

#include <atomic>

#include <gtest/gtest.h>

namespace filiform::internal {
namespace {

TEST(CellReaches, AreThoseOfTheCellAndReadOnce) {
  const auto tiles = test::storeOf(test::fineAndCoarse());
  const test::CountingStore store(*tiles);
  CellReaches reaches(store, SolverMethod::force);
  for (const std::uint32_t cell : {0U, 0U, 1U, 0U}) {
    const SolverParameters expected = automaticParameters(*tiles, cell);
    const bool known = reaches.knows(cell);
    const std::size_t before = store.loads().size();
    const std::optional<CellReach> reach = reaches.of(cell);
    ASSERT_TRUE(reach);
    EXPECT_EQ(reach->r_min_um, expected.r_min_um);
    EXPECT_EQ(reach->r_max_um, expected.r_max_um);
    EXPECT_EQ(known, store.loads().size() == before);
    EXPECT_TRUE(reaches.knows(cell));
  }
}

TEST(CellReaches, AMethodWithoutReachReadsNothing) {
  const auto tiles = test::storeOf(test::fineAndCoarse());
  const test::CountingStore store(*tiles);
  for (const SolverMethod method : {SolverMethod::basic, SolverMethod::shading, SolverMethod::climb})
    EXPECT_FALSE(CellReaches(store, method).of(0));
  EXPECT_EQ(store.loads().size(), 0U);
}

TEST(CellReaches, EndWhenTheyAreToldTo) {
  const auto store = test::storeOf(test::fineAndCoarse());
  const std::atomic<bool> stop{true};
  CellReaches reaches(*store, SolverMethod::force);
  EXPECT_THROW(reaches.of(0, &stop), Interrupted);
  EXPECT_FALSE(reaches.knows(0));
}

}  // namespace
}  // namespace filiform::internal
