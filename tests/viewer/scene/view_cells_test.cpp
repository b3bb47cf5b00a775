#include "viewer/scene/view_cells.h"

#include "tests/support/scenes/memory_store.h"
#include "tests/support/scenes/random_cells.h"

#include <gtest/gtest.h>

namespace filiform {
namespace {

class ViewCellsTest : public testing::Test {
 protected:
  ViewCellsTest() {
    std::vector<Cell> cells = test::randomColumn(3, 3, 20, 100);
    for (std::size_t i = 0; i < cells.size(); ++i) cells[i].name = std::string(1, static_cast<char>('a' + i));
    store_ = test::storeOf(std::move(cells));
  }
  std::unique_ptr<TileStore> store_;
};

TEST_F(ViewCellsTest, ShownCellsAreAloneAndUnknownNamesAreCounted) {
  ViewState view;
  view.shown = {"b", "absent", "c"};
  view.dimmed = {"c"};
  view.chosen = {"c", "a", "c"};
  view.highlighted = {"gone"};
  const ViewCells cells = viewCellsOf(view, *store_);
  EXPECT_EQ(cells.states, CellStates({CellState::hidden, CellState::shown, CellState::dimmed}));
  EXPECT_EQ(cells.chosen, std::vector<std::uint32_t>({0, 2}));
  EXPECT_TRUE(cells.highlighted.empty());
  EXPECT_EQ(cells.note, "the set does not have 2 cells of the view, such as absent");
}

TEST_F(ViewCellsTest, WithoutAShownCellOfTheSetAllButTheHiddenAreShown) {
  ViewState view;
  view.shown = {"absent"};
  view.hidden = {"a"};
  EXPECT_EQ(viewCellsOf(view, *store_).states, CellStates({CellState::hidden, CellState::shown, CellState::shown}));
  EXPECT_TRUE(viewCellsOf({}, *store_).note.empty());
}

}  // namespace
}  // namespace filiform
