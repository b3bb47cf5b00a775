#include "viewer/scene/cell_palette.h"

#include "tests/support/scenes/memory_store.h"
#include "tests/support/scenes/random_cells.h"

#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::storeOf;

TEST(CellPalettes, ColourSegmentsAsTheyAreAskedTo) {
  Cell one, two;
  for (Cell* cell : {&one, &two}) {
    const double y = cell == &one ? 0 : 100;
    const auto root = test::addSample(*cell, {0, y, 0}, kNoParent, 1, 3);
    const auto a = test::addSample(*cell, {10, y, 0}, root, 0.1F, 2);
    test::addSample(*cell, {20, y, 0}, a, 2, 4);
  }
  one.source = "a";
  two.source = "b";
  const auto store = storeOf({one, two}, 100);
  ASSERT_EQ(store->tile_count(), 1u);
  const NeuriteBatch batch = makeBatch(*store->load(0), store->loadAppearance(0));
  const auto colours = [&](ColourBy by) {
    std::vector<Rgba> list;
    CellPalette palette = makePalette(2, by, nullptr, nullptr);
    palette.shallow_um = 100, palette.deep_um = 0;
    for (const DrawnSegment& s : batch.segments) list.push_back(paintedColour(s, batch, palette));
    return list;
  };
  using List = std::vector<Rgba>;
  const Rgba c0 = colourOfNumber(0), c1 = colourOfNumber(1), deep = colourOnRamp(1), shallow = colourOnRamp(0);
  EXPECT_NE(c0, c1);
  EXPECT_NE(markOfCell(0), markOfCell(1));
  EXPECT_EQ(colours(ColourBy::cell), (List{c0, c0, c1, c1}));
  EXPECT_EQ(colours(ColourBy::type), (List{colourOfType(2), colourOfType(4), colourOfType(2), colourOfType(4)}));
  EXPECT_EQ(colours(ColourBy::depth), (List{deep, deep, shallow, shallow}));
  EXPECT_EQ(colours(ColourBy::tile), (List{c0, c0, c0, c0}));
  const List radius = colours(ColourBy::radius);
  EXPECT_EQ(radius[0], radius[2]);
  EXPECT_LT(radius[0].g, radius[1].g);  // thicker is lighter
  for (const ColourBy by : kColourings) EXPECT_EQ(colouringNamed(toString(by)), by);
  EXPECT_EQ(colouringNamed("taste"), std::nullopt);
}

TEST(CellPalettes, HoldColoursAndStatesOfCells) {
  CellColours colours;
  colours.of_cell = {{1, 2, 3}, {4, 5, 6}};
  const CellStates states{CellState::dimmed, CellState::hidden};
  const CellPalette palette = makePalette(4, ColourBy::radius, &colours, &states);
  EXPECT_EQ(palette.colour, ColourBy::cell) << "colours of cells replace other colours";
  ASSERT_EQ(palette.of_cell.size(), 4u);
  EXPECT_EQ(palette.of_cell[0], (Rgba{1, 2, 3, 128}));
  EXPECT_EQ(palette.of_cell[1], (Rgba{4, 5, 6, 0}));
  EXPECT_EQ(palette.of_cell[2], colourOfNumber(2)) << "beyond both lists";
}

TEST(CellPalettes, ASegmentNamesItsCellAndTheKindOfItsType) {
  for (const std::uint32_t cell : {0U, 7U, (1U << kCellBits) - 1})
    for (const std::uint16_t type : {0, 1, 2, 3, 4, 5, 7, 65535}) {
      const std::uint32_t paint = ownerPaint(cell, type);
      EXPECT_EQ(cellOfPaint(paint), cell);
      EXPECT_EQ(colourOfType(typeOfPaint(paint)), colourOfType(type));
    }
  const Rgba colour{1, 20, 255, 3};
  EXPECT_EQ(colourOfPaint(paintOf(colour)), colour);
}

}  // namespace
}  // namespace filiform
