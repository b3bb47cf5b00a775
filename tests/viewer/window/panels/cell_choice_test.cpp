#include "viewer/window/panels/internal/cell_choice.h"

#include <vector>

#include <gtest/gtest.h>

namespace filiform::internal {
namespace {

using Ids = std::vector<std::uint32_t>;

Ids inState(const CellChoice& choice, std::uint32_t cells, CellState state) {
  Ids found;
  for (std::uint32_t cell = 0; cell < cells; ++cell)
    if (choice.stateOf(cell) == state) found.push_back(cell);
  return found;
}

TEST(CellChoices, ChooseAloneOrInAddition) {
  CellChoice choice(9);
  choice.choose(Ids{7, 2, 7});
  EXPECT_EQ(choice.chosen(), (Ids{2, 7}));
  choice.toggle(4);
  choice.toggle(2);
  EXPECT_EQ(choice.chosen(), (Ids{4, 7}));
  EXPECT_EQ(choice.lastChosen(), 2u);
  EXPECT_TRUE(choice.isChosen(4));
  EXPECT_FALSE(choice.isChosen(2));
  choice.choose({});
  EXPECT_TRUE(choice.chosen().empty());
  EXPECT_EQ(choice.lastChosen(), UINT32_MAX);
}

TEST(CellChoices, IsolateHideDimInvertAndShow) {
  CellChoice choice(5);
  EXPECT_EQ(choice.states(), nullptr);
  EXPECT_EQ(choice.text(), "");
  choice.isolate(Ids{1, 3});
  EXPECT_EQ(inState(choice, 5, CellState::shown), (Ids{1, 3}));
  EXPECT_EQ(inState(choice, 5, CellState::hidden), (Ids{0, 2, 4}));
  EXPECT_EQ(choice.text(), "2 of 5 cells shown");
  EXPECT_TRUE(choice.isAlone(Ids{1, 3}));
  EXPECT_FALSE(choice.isAlone(Ids{1, 2}));
  EXPECT_FALSE(choice.isAlone(Ids{1}));
  choice.set(Ids{3}, CellState::dimmed);
  EXPECT_EQ(choice.text(), "1 of 5 cells shown, 1 dimmed");
  choice.invert();
  EXPECT_EQ(inState(choice, 5, CellState::shown), (Ids{0, 2, 4}));
  choice.set(Ids{0, 2, 4}, CellState::hidden);
  EXPECT_EQ(choice.text(), "0 of 5 cells shown");
  choice.invert();
  EXPECT_EQ(choice.states(), nullptr) << "all cells are shown again";
  choice.set(Ids{0}, CellState::hidden);
  const auto before = choice.states();
  EXPECT_EQ(choice.states(), before) << "the same object, so that a frame can compare it";
  choice.showAll();
  EXPECT_EQ(choice.states(), nullptr);
}

}  // namespace
}  // namespace filiform::internal
