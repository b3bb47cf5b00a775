#include "index/ingest/set_attributes.h"

#include "index/attributes/cell_attributes.h"
#include "index/errors.h"
#include "index/ingest/growth.h"
#include "index/levels/levels.h"
#include "index/verify/verify.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/temp_folder.h"

#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

class SetAttributes : public ::testing::Test {
 protected:
  void SetUp() override {
    std::vector<Cell> cells = test::randomColumn(5, 6, 260, 150);
    for (std::size_t i = 0; i < cells.size(); ++i) {
      cells[i].source = "lab/c" + std::to_string(i) + ".CNG.swc";
      cells[i].attributes = {{"age", std::int64_t{10} + static_cast<std::int64_t>(i)}, {"region", std::string("V1")}};
    }
    cells_ = cells;
    CellList list(std::move(cells));
    ingest(list, set_, {.capacity = 40, .levels = true});
  }
  static AttributeTable table(const std::string& text) { return AttributeTable::parse(text, "t.csv", "cell"); }
  std::string value(const std::string& cell, const std::string& attribute) const {
    const auto set = TileSet::open(set_);
    const CellAttributes attributes(*set);
    const auto column = attributes.find(attribute);
    return column ? textOf(attributes.value(*column, set->findCell(cell).value())) : "no such column";
  }
  std::string reasonOf(const std::string& text, bool replace = false) const {
    try {
      setAttributes(table(text), set_, replace);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }

  test::TempFolder folder_;
  std::string set_ = folder_ / "s.fil";
  std::vector<Cell> cells_;
};

TEST_F(SetAttributes, ATableAddsItsColumnsAndLeavesTheRest) {
  const auto before = TileSet::open(set_);
  const SetAttributesResult result = setAttributes(table("cell,mtype,layer\nc0,L5_PC,5\nc2,,6\nnobody,x,1\n"), set_);
  EXPECT_EQ(result.with_row, 2u);
  EXPECT_EQ(result.without_row, 4u);
  EXPECT_EQ(result.rows_without_cell, 1u);
  ASSERT_EQ(result.columns.size(), 2u);
  EXPECT_EQ(result.columns[0].given, 1u);
  EXPECT_EQ(result.columns[0].empty, 1u);
  EXPECT_TRUE(result.columns[1].is_new);
  EXPECT_EQ(result.columns[1].type, AttributeType::integer);
  EXPECT_EQ(value("c0", "mtype"), "L5_PC");
  EXPECT_EQ(value("c2", "layer"), "6");
  EXPECT_EQ(value("c2", "mtype"), "");
  EXPECT_EQ(value("c5", "age"), "15");
  EXPECT_EQ(value("c5", "region"), "V1");
  const auto set = TileSet::open(set_);
  EXPECT_NE(set->revision(), before->revision());
  EXPECT_FALSE(set->grown());
  EXPECT_TRUE(Levels::open(*set) != nullptr);
  EXPECT_TRUE(verify(set_, {.deep = true}).sound());
  EXPECT_EQ(before->load(0)->segment_count(), set->load(0)->segment_count());  // an open set stays whole
}

TEST_F(SetAttributes, CompactSetsHaveTheBytesOfOneIngestWithTheTable) {
  const AttributeTable one = table("cell,mtype\nc0,a\nc1,b\nc2,c\n"), two = table("cell,mtype,age\nc1,x,\nc4,y,3\n");
  setAttributes(one, set_);
  setAttributes(two, set_, true);
  compactSet(set_);
  CellList list(cells_);
  AttributedCells first(list, one);
  AttributedCells both(first, two);
  const std::string other = folder_ / "other.fil";
  const IngestResult expected = ingest(both, other, {.capacity = 40, .levels = true});
  EXPECT_EQ(TileSet::open(set_)->revision(), expected.revision);
}

TEST_F(SetAttributes, OtherValuesStayUnlessTheyAreToBeReplaced) {
  EXPECT_EQ(reasonOf("cell,age\nc0,10\nc1,99\nc2,98\n"),
            "t.csv: column age: cell c1 has '11' already, and the table says '99'; 2 values in all; --replace replaces "
            "values, or leave the column out");
  EXPECT_EQ(value("c1", "age"), "11");
  const SetAttributesResult result = setAttributes(table("cell,age\nc0,10\nc1,99\nc2,98\n"), set_, true);
  EXPECT_EQ(result.columns[0].replaced, 2u);
  EXPECT_EQ(result.columns[0].same, 1u);
  EXPECT_FALSE(result.columns[0].is_new);
  EXPECT_EQ(value("c1", "age"), "99");
  EXPECT_EQ(value("c3", "age"), "13");
  const std::string revision = TileSet::open(set_)->revision();
  EXPECT_TRUE(setAttributes(table("cell,age\nc1,99\n"), set_).unchanged);
  EXPECT_EQ(TileSet::open(set_)->revision(), revision);
}

TEST_F(SetAttributes, ATableThatBelongsToNoCellIsRefused) {
  EXPECT_EQ(reasonOf("cell,age\n7,1\n"),
            "t.csv: no row belongs to a cell of the set: the first row is for '7', and the first cell is 'c0'; does "
            "--key name the right column?");
  EXPECT_EQ(reasonOf("cell\nc0\n"), "t.csv: has no column beside that of the names of cells; nothing to keep");
}

TEST_F(SetAttributes, GrownSetsKeepTheirTilesAndRemovedCellsGetNothing) {
  removeCells({"c1"}, set_);
  std::vector<Cell> more = test::randomColumn(6, 1, 60, 150);
  more[0].source = "other/c0.swc";  // with the name of another cell in front of its folder
  more[0].name = "new";
  CellList list(std::move(more));
  addCells(list, set_);
  const SetAttributesResult result = setAttributes(table("cell,kind\nc0,a\nc1,b\nnew,c\n"), set_);
  EXPECT_EQ(result.with_row, 2u);
  EXPECT_EQ(result.rows_without_cell, 1u);
  EXPECT_EQ(value("c0", "kind"), "a");
  EXPECT_EQ(value("new", "kind"), "c");
  EXPECT_TRUE(TileSet::open(set_)->grown());
  EXPECT_TRUE(verify(set_, {.deep = true}).sound());
}

}  // namespace
}  // namespace filiform
