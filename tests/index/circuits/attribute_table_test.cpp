#include "index/circuits/attribute_table.h"

#include "index/errors.h"

#include <algorithm>
#include <string>

#include <gtest/gtest.h>

namespace filiform {
namespace {

std::string attributeText(const AttributeTable& table, std::string_view key) {
  std::string text;
  const std::size_t row = table.find(key);
  if (row == AttributeTable::kNone) return "none";
  for (const CellAttribute& attribute : table.attributes(row))
    text += attribute.name + "=" + textOf(attribute.value) + ";";
  return text;
}

TEST(AttributeTable, ReadsCommasTabsAndSemicolons) {
  for (const char separator : {',', '\t', ';'}) {
    std::string text = "\xEF\xBB\xBFneuron_id,neuron_name,species\r\n7,cell one,rat\r\n\r\n8,b,\r\n";
    std::replace(text.begin(), text.end(), ',', separator);
    const AttributeTable table = AttributeTable::parse(text, "t", "neuron_name");
    EXPECT_EQ(table.rows(), 2u);
    EXPECT_EQ(attributeText(table, "cell one"), "neuron_id=7;species=rat;");
    EXPECT_EQ(attributeText(table, "b"), "neuron_id=8;");
    EXPECT_EQ(attributeText(table, "c"), "none");
  }
}

TEST(AttributeTable, NamesThatLookLikeNumbersStayText) {
  const AttributeTable table = AttributeTable::parse(
      "name,code,root,mixed,depth\na,7e5,720575940621039145,720575940621039145,1.50\n"
      "b,700000,720575940621039146,2.50,2\nc,7f3,,,\n",
      "t", "name");
  EXPECT_EQ(attributeText(table, "a"), "code=7e5;root=720575940621039145;mixed=720575940621039145;depth=1.5;");
  EXPECT_EQ(attributeText(table, "b"), "code=700000;root=720575940621039146;mixed=2.50;depth=2;");
  EXPECT_EQ(attributeText(table, "c"), "code=7f3;");
}

TEST(AttributeTable, DecimalCommasMakeNumbersUnlessTheyMayBeThousands) {
  const AttributeTable table = AttributeTable::parse(
      "name;depth;price;both;list\na;1,5;1,234;1,5;1,2,3\nb;-0,25;12,500;2.5;4\nc;3;7;1;5\n", "t", "name");
  EXPECT_EQ(attributeText(table, "a"), "depth=1.5;price=1,234;both=1,5;list=1,2,3;");
  EXPECT_EQ(attributeText(table, "b"), "depth=-0.25;price=12,500;both=2.5;list=4;");
  EXPECT_EQ(table.attributes(table.find("c")).front().value, AttributeValue(std::int64_t{3}));
  EXPECT_EQ(attributeText(AttributeTable::parse("name,d\na,\"1,234\"\nb,\"0,5\"\n", "t", "name"), "a"), "d=1.234;");
}

TEST(AttributeTable, QuotedFieldsHoldAnything) {
  const AttributeTable table =
      AttributeTable::parse(",name,region\n0,a,\"['neocortex', 'layer \"\"5\"\"']\nleft\"\n1,a,x\n", "t", "name");
  EXPECT_EQ(attributeText(table, "a"), "region=['neocortex', 'layer \"5\"']\nleft;");
  EXPECT_EQ(table.repeated(), 1u);
  EXPECT_EQ(table.names(), (std::vector<std::string>{"region"}));  // the first column has no name
}

TEST(AttributeTable, MistakesNameTheirLine) {
  const auto reason = [](const std::string& text) -> std::string {
    try {
      AttributeTable::parse(text, "t.csv", "name");
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(reason("id,species\n"), "t.csv:1: has no column name (--key); it has id, species");
  EXPECT_EQ(reason("name,a,a\n"), "t.csv:1: has two columns a");
  EXPECT_EQ(reason("name,a\nx,1\ny,1,2\n"), "t.csv:3: has 3 fields, but the header has 2");
  EXPECT_EQ(reason("name,a\nx,\"1\n"), "t.csv:2: a quote is not closed");
  EXPECT_EQ(reason(""), "t.csv:1: is empty; the first line must name the columns");
  EXPECT_EQ(reason("name\n\xFF\n"), "t.csv:1: is not UTF-8 text");
}

TEST(AttributedCells, CountsCellsAndRowsWithoutPartner) {
  const AttributeTable table = AttributeTable::parse("name,type\nn1,7\nn2,x\nnobody,y\n", "t", "name");
  std::vector<Cell> cells(3);
  cells[0].source = "lab.zip/CNG version/n1.CNG.swc";
  cells[1].source = "other.swc";
  cells[2].source = "b.swc";
  cells[2].name = "n2";
  CellList list(std::move(cells));
  AttributedCells attributed(list, table);
  std::string seen;
  for (Cell cell; attributed.next(cell);)
    for (const CellAttribute& attribute : cell.attributes) seen += attribute.name + "=" + textOf(attribute.value) + ";";
  EXPECT_EQ(seen, "type=7;type=x;");
  EXPECT_EQ(attributed.with_row(), 2u);
  EXPECT_EQ(attributed.without_row(), 1u);
  EXPECT_EQ(attributed.rows_without_cell(), 1u);
}

}  // namespace
}  // namespace filiform
