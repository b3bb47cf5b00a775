#include "index/compare/set_changes.h"

#include "tests/support/scenes/memory_store.h"
#include "tests/support/scenes/random_cells.h"

#include <map>
#include <stdexcept>

#include <gtest/gtest.h>

namespace filiform {
namespace {

std::vector<Cell> columnOfNamed() {
  std::vector<Cell> cells = test::randomColumn(4, 6, 150, 80);
  for (std::size_t i = 0; i < cells.size(); ++i) cells[i].name = std::string(1, static_cast<char>('a' + i));
  return cells;
}

std::map<std::string, CellDifference> differencesOf(const std::vector<Cell>& a, const std::vector<Cell>& b,
                                                    const SetChangesOptions& options = {}) {
  const auto before = test::storeOf(a), now = test::storeOf(b);
  std::map<std::string, CellDifference> found;
  std::uint64_t visits = 0;
  compareSets(*before, *now, options, [&](const CellDifference& cell) {
    ++visits;
    found.emplace(cell.names[cell.names[0].empty() ? 1 : 0], cell);
  });
  EXPECT_EQ(found.size(), visits);
  EXPECT_EQ(cellsOfBoth(*before, *now), visits);
  return found;
}

TEST(SetChanges, AreByNameWhateverTheOrderAndMemory) {
  const std::vector<Cell> before = columnOfNamed();
  std::vector<Cell> now{before[5], before[3], before[1], before[0]};  // without c and e
  for (Vector3d& p : now[1].positions_um) p.x() += 7;                 // d
  test::addSample(now[2], Vector3d(200, 0, 0), 0);                    // b
  now.push_back(before[2]);
  now.back().name = "new";
  for (const std::uint64_t memory : {std::uint64_t{1}, std::uint64_t{1} << 30}) {
    const auto found = differencesOf(before, now, {.memory_bytes = memory, .threads = 2});
    ASSERT_EQ(found.size(), 7u);
    EXPECT_EQ(found.at("a").change.kind, CellFate::kSame);
    EXPECT_EQ(found.at("f").change.kind, CellFate::kSame);
    EXPECT_EQ(found.at("c").change.kind, CellFate::kRemoved);
    EXPECT_EQ(found.at("e").change.kind, CellFate::kRemoved);
    EXPECT_EQ(found.at("new").change.kind, CellFate::kAdded);
    EXPECT_EQ(found.at("new").samples[0], 0u);
    EXPECT_EQ(found.at("new").samples[1], before[2].samples());
    EXPECT_EQ(found.at("new").length_um[1], found.at("c").length_um[0]);
    EXPECT_EQ(found.at("d").change.kind, CellFate::kMoved);
    EXPECT_NEAR(found.at("d").change.moved_um, 7, 0.01);
    EXPECT_EQ(found.at("b").change.kind, CellFate::kChanged);
    EXPECT_EQ(found.at("b").change.samples_added, 1u);
    EXPECT_FALSE(found.at("b").distance);
  }
  const CellDifference changed = differencesOf(before, now, {.within_um = 3}).at("b");
  ASSERT_TRUE(changed.distance);
  EXPECT_NEAR((*changed.distance)[0].max_um, 0, 1e-12) << "all of the old cell is in the new one";
  EXPECT_GT((*changed.distance)[1].max_um, 50);
}

TEST(SetChanges, OfNothingAreNone) {
  EXPECT_TRUE(differencesOf({}, {}).empty());
  EXPECT_EQ(differencesOf({}, columnOfNamed()).at("a").change.kind, CellFate::kAdded);
  std::vector<Cell> empty = columnOfNamed();
  empty[0].clearSamples();
  empty[0].parents.clear();
  const CellDifference cell = differencesOf(columnOfNamed(), empty, {.within_um = 1}).at("a");
  EXPECT_EQ(cell.change.kind, CellFate::kChanged);
  EXPECT_EQ(cell.change.samples_removed, columnOfNamed()[0].samples());
  EXPECT_FALSE(cell.distance) << "there is nothing to measure to";
}

TEST(SetChanges, OfTwoCellsHaveDistancesIfWanted) {
  const std::vector<Cell> cells = columnOfNamed();
  const auto store = test::storeOf(cells);
  const CellGraph a = readCell(*store, 0, true), b = readCell(*store, 1, true);
  EXPECT_FALSE(differenceOf(a, b, nullptr).distance);
  const TraceDistanceOptions measuring{.within_um = 5};
  const CellDifference pair = differenceOf(a, b, &measuring);
  EXPECT_EQ(pair.names, (std::array<std::string, 2>{"a", "b"}));
  EXPECT_EQ(pair.change.kind, CellFate::kChanged);
  ASSERT_TRUE(pair.distance);
  EXPECT_EQ((*pair.distance)[0].length_um, pair.length_um[0]);
  EXPECT_EQ((*pair.distance)[1].mean_um, traceDistance(b, a, measuring).mean_um);
}

TEST(SetChanges, CanBeEnded) {
  const auto store = test::storeOf(columnOfNamed());
  EXPECT_THROW(compareSets(*store, *store, {.check = [](std::uint64_t) { throw std::runtime_error("ended"); }},
                           [](const CellDifference&) {}),
               std::runtime_error);
}

}  // namespace
}  // namespace filiform
