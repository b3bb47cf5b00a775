#include "viewer/scene/cell_colours.h"

#include "index/ingest/ingest.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/temp_folder.h"

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

// Ten cells of three kinds, the last without attributes; a number with few values, and one with a value a cell.
class CellColouring : public ::testing::Test {
 protected:
  CellColouring() {
    std::vector<Cell> all = test::randomColumn(7, 10, 20, 100);
    for (std::uint32_t c = 0; c + 1 < all.size(); ++c)
      all[c].attributes = {{"type", std::string(1, static_cast<char>('a' + c % 3))},
                           {"layer", static_cast<std::int64_t>(c % 3) * 2},
                           {"depth", 0.5 + c}};
    CellList stream(all);
    ingest(stream, folder_ / "a.fil", {.capacity = 40});
    set_ = TileSet::open(folder_ / "a.fil");
    attributes_ = std::make_unique<CellAttributes>(*set_);
  }
  std::vector<std::string> legendOf(const CellColours& colours) const {
    std::vector<std::string> lines;
    for (const CellColours::Entry& entry : colours.legend)
      lines.push_back(entry.value + ": " + std::to_string(entry.cells));
    return lines;
  }

  test::TempFolder folder_;
  std::unique_ptr<TileSet> set_;
  std::unique_ptr<CellAttributes> attributes_;
};

using Lines = std::vector<std::string>;

TEST_F(CellColouring, TheLegendListsWhatIsColoured) {
  const auto all = coloursByAttribute(*set_, *attributes_, "type");
  EXPECT_EQ(legendOf(*all), (Lines{"a: 3", "b: 3", "c: 3", "(none): 1"}));
  const auto some = coloursByAttribute(*set_, *attributes_, "type", {.only = {{1, 2, 4}}});
  EXPECT_EQ(legendOf(*some), (Lines{"b: 2", "c: 1"}));
  EXPECT_EQ(some->legend.front().colour, all->legend[1].colour);
  for (std::uint32_t c = 0; c < 10; ++c) {
    const bool selected = c == 1 || c == 2 || c == 4;
    EXPECT_EQ(some->of_cell[c], selected ? all->of_cell[c] : unchosenOn(Theme::dark)) << c;
  }
  const auto light = coloursByAttribute(*set_, *attributes_, "type", {.only = {{1}}, .theme = Theme::light});
  EXPECT_EQ(light->of_cell[0], unchosenOn(Theme::light));
  EXPECT_EQ(light->of_cell[1], all->of_cell[1]);
  // Values that are switched off stay in the legend, to switch them on again.
  const auto values = coloursByAttribute(*set_, *attributes_, "type", {.values = {{"a"}}});
  EXPECT_EQ(legendOf(*values), legendOf(*all));
  EXPECT_FALSE(values->legend[1].chosen);
}

TEST_F(CellColouring, NumbersGetARamp) {
  const auto few = coloursByAttribute(*set_, *attributes_, "layer");
  EXPECT_EQ(legendOf(*few), (Lines{"0: 3", "2: 3", "4: 3", "(none): 1"}));
  for (const std::size_t step : {0, 1, 2})
    EXPECT_EQ(few->legend[step].colour, colourOnRamp(static_cast<double>(step) / 2));
}

TEST_F(CellColouring, MeasuresGetARampWithTheirUnitAndCellsWithoutOneAreGrey) {
  CellValues lengths{"measure:length", "um", std::vector<double>(10, NAN)};
  const auto none = coloursByNumbers(*set_, lengths);
  EXPECT_EQ(legendOf(*none), Lines{"(none): 10"});
  for (std::uint32_t c = 0; c < 10; ++c) EXPECT_EQ(none->of_cell[c], colourOnRamp(NAN));
  lengths.of_cell[3] = 80, lengths.of_cell[7] = 20, lengths.of_cell[8] = 20;
  const auto some = coloursByNumbers(*set_, lengths, {.only = {{3, 4, 7}}});
  EXPECT_EQ(some->attribute, "measure:length");
  EXPECT_EQ(some->unit, "um");
  EXPECT_EQ(legendOf(*some), (Lines{"20: 1", "80: 1", "(none): 1"}));
  EXPECT_EQ(some->of_cell[3], colourOnRamp(1));
  EXPECT_EQ(some->of_cell[7], colourOnRamp(0));
  EXPECT_EQ(some->of_cell[4], colourOnRamp(NAN));
  EXPECT_EQ(some->of_cell[8], unchosenOn(Theme::dark));
}

}  // namespace
}  // namespace filiform
