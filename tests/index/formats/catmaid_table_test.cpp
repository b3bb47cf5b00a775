#include "index/formats/internal/catmaid_table.h"

#include "index/input/input.h"
#include "tests/support/temp_folder.h"
#include "tests/support/zip_builder.h"

#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

const std::string kColumnNames = "skeleton_id, treenode_id, parent_treenode_id, x, y, z, r\n";

struct TableReading {
  std::vector<Cell> cells;
  std::string table;
  std::vector<SourceReport> reports;
};

TableReading readInput(const std::string& path, InputOptions options = {}) {
  Input input({path}, std::move(options));
  TableReading reading;
  for (Cell cell; input.next(cell);) reading.cells.push_back(cell);
  std::ostringstream table;
  writeCheckTable(table, input.reports());
  reading.table = table.str().substr(table.str().find('\n') + 1);
  reading.reports = input.reports();
  return reading;
}

TableReading readTable(const std::string& text, const InputOptions& options = {}) {
  const test::TempFolder folder;
  test::writeBytes(folder.file("a.csv"), text);
  return readInput(folder.file("a.csv"), options);
}

TEST(CatmaidTable, OneCellASkeletonInNanometres) {
  const TableReading reading = readTable(kColumnNames +
                                         "7, 1, null, 10, 20, 30, 2000\n9, 5, null, 0, 0, 0, 1\n"
                                         "7, 2, 1, 20, 20, 30, 4\n9, 6, 5, 0, 0, 1000, 1\n7, 3, 2, 30, 20, 30, 4\n");
  EXPECT_EQ(reading.table, "a.csv\taccept\t5\t3\t-\t-\n");
  ASSERT_EQ(reading.cells.size(), 2u);
  EXPECT_EQ(reading.cells[0].source, "a.csv/7");
  EXPECT_EQ(reading.cells[1].source, "a.csv/9");
  EXPECT_EQ(reading.cells[0].sample_ids, (std::vector<std::int64_t>{1, 2, 3}));
  EXPECT_EQ(reading.cells[0].parents, (std::vector<std::uint32_t>{kNoParent, 0, 1}));
  EXPECT_TRUE(reading.cells[0].positions_um[0].isApprox(Vector3d(0.01, 0.02, 0.03)));
  EXPECT_FLOAT_EQ(reading.cells[0].radii_um[0], 2.0f);
}

TEST(CatmaidTable, TakesOtherOrdersQuotesSeparatorsAndRoots) {
  for (const std::string text :
       {"x,y,z,treenode_id,parent_id,skeleton_id\n1,2,3,1,,7\n1,2,4,2,1,7\n",
        "\"skeleton_id\",\"treenode_id\",\"parent_treenode_id\",\"x\",\"y\",\"z\"\r\n\"7\",\"1\",\"None\",\"1\",\"2\","
        "\"3\"\r\n"
        "\"7\",\"2\",\"1\",\"1\",\"2\",\"4\"\r\n",
        "skeleton_id;treenode_id;parent_treenode_id;x;y;z;r\n7;1;-1;1;2;3;1\n7;2;1;1;2;4;1\n",
        "\xEF\xBB\xBFSkeleton_ID\tTreenode_ID\tParent_Treenode_ID\tX\tY\tZ\n7\t1\tNULL\t1\t2\t3\n7\t2\t1\t1\t2\t4\n"}) {
    const TableReading reading = readTable(text);
    const bool marked = text.starts_with("\xEF\xBB\xBF");
    EXPECT_EQ(reading.table, marked ? "a.csv\twarn\t2\t1\t-\tW_BOM:1\n" : "a.csv\taccept\t2\t1\t-\t-\n") << text;
    ASSERT_EQ(reading.cells.size(), 1u);
    EXPECT_EQ(reading.cells[0].source, "a.csv/7");
    EXPECT_TRUE(reading.cells[0].positions_um[1].isApprox(Vector3d(0.001, 0.002, 0.004))) << text;
  }
}

TEST(CatmaidTable, AnotherUnitReplacesNanometres) {
  InputOptions options;
  options.swc.unit_um = 0.004;
  EXPECT_TRUE(
      readTable(kColumnNames + "7,1,,1000,0,0,1\n", options).cells.at(0).positions_um[0].isApprox(Vector3d(4, 0, 0)));
}

TEST(CatmaidTable, BadRowsAreDroppedWithTheirLine) {
  const TableReading reading =
      readTable(kColumnNames +
                "7,1,null,0,0,0,1\n7,2\n7,x,1,0,0,0,1\n7,3,1,0,nan,0,1\n,4,1,0,0,0,1\n7,1,1,5,5,5,1\n"
                "7,5,y,1,1,1,-1\n8,6,5,2,2,2,1\n");
  EXPECT_EQ(reading.table,
            "a.csv\twarn\t3\t0\t7:3,7:4,7:5,7:6,7:7\tW_BAD_LINE:2,W_BAD_PARENT:1,W_BAD_RADIUS:1,W_DUP_ID:1,"
            "W_MISSING_PARENT:1,W_NONFINITE:1,W_SHORT_LINE:1\n");
}

TEST(CatmaidTable, WithoutItsColumnsItIsRefusedByName) {
  const TableReading reading = readTable("skeleton_id, treenode_id, x, y\n7, 1, 2, 3\n");
  ASSERT_EQ(reading.reports.size(), 1u);
  EXPECT_EQ(refusalReason(reading.reports[0].report),
            "line 1: a CSV table without the columns of CATMAID's skeletons; missing: parent_treenode_id, z");
}

TEST(CatmaidTable, IsNeverReadAsSwc) {
  const test::TempFolder folder;
  test::writeBytes(folder.file("a.swc"), kColumnNames + "7, 1, null, 10, 20, 30, 2000\n8, 2, 1, 20, 20, 30, 0\n");
  const TableReading reading = readInput(folder.file("a.swc"));
  EXPECT_EQ(reading.table, "a.swc\trefuse\t0\t0\t-\tE_FORMAT:1\n");
  EXPECT_EQ(refusalReason(reading.reports[0].report), "line 1: CATMAID's columns; name the file .csv");
}

TEST(CatmaidTable, SwcWithCommasIsReadUnderItsEnding) {
  EXPECT_EQ(readTable("1,1,0,0,0,5,-1\n2,3,0,6,0,1,1\n").table, "a.csv\twarn\t2\t1\t-\tW_SEPARATOR:1\n");
}

TEST(CatmaidTable, FoldersAndArchivesGiveItsSkeletons) {
  const test::TempFolder folder;
  const std::string table = kColumnNames + "7, 1, null, 10, 20, 30, 2000\n9, 2, null, 20, 20, 30, 1\n";
  test::writeBelow(folder, "f/a.csv", table);
  test::writeBelow(folder, "f/other.csv", "name,depth\nx,1\n");
  test::writeBytes(folder.file("a.zip"), test::buildZip({test::zipMember("in/a.csv", table)}));
  EXPECT_EQ(readInput(folder.file("f")).table, "a.csv\taccept\t2\t0\t-\t-\nother.csv\tpassed\t0\t0\t-\t-\n");
  const TableReading packed = readInput(folder.file("a.zip"));
  EXPECT_EQ(packed.table, "a.zip\taccept\t2\t0\t-\t-\n");
  ASSERT_EQ(packed.cells.size(), 2u);
  EXPECT_EQ(packed.cells[0].source, "a.zip/in/a.csv/7");
}

}  // namespace
}  // namespace filiform
