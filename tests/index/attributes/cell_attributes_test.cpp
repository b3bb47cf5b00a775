#include "index/attributes/cell_attributes.h"

#include "index/attributes/cell_filter.h"
#include "index/errors.h"
#include "index/ingest/growth.h"
#include "index/verify/verify.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/temp_folder.h"

#include <cmath>
#include <filesystem>
#include <map>
#include <random>
#include <string>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::TempFolder;

// Cells with a text, an integer, a real and a mixed attribute; some have none.
std::vector<Cell> columnWithAttributes(std::uint32_t cells) {
  std::vector<Cell> all = test::randomColumn(7, cells, 40, 150);
  for (std::uint32_t c = 0; c < cells; ++c) {
    if (c % 7 == 3) continue;
    all[c].attributes = {{"mtype", "L" + std::to_string(c % 5) + "_TPC:" + (c % 2 == 0 ? "A" : "B")},
                         {"layer", static_cast<std::int64_t>(c % 6) - 1},
                         {"depth um", 0.25 * c}};
    if (c % 3 == 0) all[c].attributes.push_back({"mixed", std::int64_t{c}});
    if (c % 3 == 1) all[c].attributes.push_back({"mixed", c + 0.5});
    if (c == 5) all[c].attributes.push_back({"note", "a\tb \xC3\xA9"});
    if (c == 6) all[c].attributes.push_back({"id", INT64_MIN});
    if (c == 8) all[c].attributes.push_back({"id", INT64_MAX});
  }
  return all;
}

void makeAttributed(const std::vector<Cell>& cells, const std::string& path) {
  CellList stream(cells);
  ingest(stream, path, {.capacity = 40});
}

void addAttributed(const std::vector<Cell>& cells, const std::string& path) {
  CellList stream(cells);
  addCells(stream, path, {});
}

// Attributes as text, by the name of the cell and of the attribute.
std::map<std::string, std::map<std::string, std::string>> attributesOfSet(const std::string& path) {
  const auto set = TileSet::open(path);
  const CellAttributes attributes(*set);
  std::map<std::string, std::map<std::string, std::string>> table;
  for (std::uint32_t c = 0; c < set->cell_count(); ++c)
    for (const CellAttribute& attribute : attributes.of(c))
      table[set->cell(c).name][attribute.name] = textOf(attribute.value);
  return table;
}

std::map<std::string, std::string> bytesOfFiles(const std::string& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
    if (entry.is_regular_file()) files[entry.path().filename().string()] = test::readBytes(entry.path().string());
  return files;
}

TEST(CellAttributes, ComeBackAsGiven) {
  const TempFolder folder;
  const std::vector<Cell> all = columnWithAttributes(30);
  makeAttributed(all, folder / "a.fil");
  const auto set = TileSet::open(folder / "a.fil");
  const CellAttributes attributes(*set);
  ASSERT_EQ(attributes.columns().size(), 6u);
  for (std::uint32_t c = 0; c < 30; ++c) {
    EXPECT_EQ(attributes.of(c).size(), all[c].attributes.size());
    for (const CellAttribute& given : all[c].attributes) {
      const auto column = attributes.find(given.name);
      ASSERT_TRUE(column) << given.name;
      const AttributeValue found = attributes.value(*column, c);
      EXPECT_EQ(textOf(found), textOf(given.value));
      EXPECT_EQ(attributes.columns()[*column].type, given.name == "mixed" ? AttributeType::real : typeOf(given.value));
    }
  }
  const auto layer = attributes.find("layer"), mtype = attributes.find("mtype");
  const std::vector<double> numbers = attributes.numbers(*layer);
  const std::vector<std::uint32_t> codes = attributes.codes(*mtype);
  for (std::uint32_t c = 0; c < 30; ++c) {
    EXPECT_EQ(std::isnan(numbers[c]), c % 7 == 3);
    EXPECT_EQ(codes[c] == CellAttributes::kNoCode, c % 7 == 3);
    if (c % 7 == 3) continue;
    EXPECT_EQ(numbers[c], static_cast<double>(c % 6) - 1);
    EXPECT_EQ(attributes.dictionary(*mtype)[codes[c]], std::get<std::string>(all[c].attributes[0].value));
  }
  EXPECT_FALSE(attributes.find("nothing"));
}

TEST(CellAttributes, ManyPagesAndManyTexts) {
  const TempFolder folder;
  std::vector<Cell> all(9000);
  for (std::uint32_t c = 0; c < all.size(); ++c) {
    test::addSample(all[c], Vector3d(c % 97, c % 89, c % 83));
    all[c].source = std::to_string(100000 + c);
    if (c % 2 == 0) all[c].attributes = {{"a", "text " + std::to_string(c * 7919 % 9000)}, {"b", std::int64_t{c} * c}};
  }
  makeAttributed(all, folder / "a.fil");
  const auto set = TileSet::open(folder / "a.fil");
  const CellAttributes attributes(*set);
  EXPECT_EQ(attributes.columns()[0].values, 4500u);
  EXPECT_EQ(attributes.columns()[0].entries, 4500u);
  for (std::uint32_t c = 0; c < all.size(); c += 2) {
    EXPECT_EQ(textOf(attributes.value(0, c)), std::get<std::string>(all[c].attributes[0].value));
    EXPECT_EQ(textOf(attributes.value(1, c)), textOf(all[c].attributes[1].value));
  }
  EXPECT_TRUE(verify(folder / "a.fil", {.deep = true}).sound());
}

TEST(CellAttributes, SetsWithoutThemHaveNoSection) {
  const TempFolder folder;
  makeAttributed(test::randomColumn(7, 5, 40, 150), folder / "a.fil");
  const auto set = TileSet::open(folder / "a.fil");
  EXPECT_TRUE(CellAttributes(*set).empty());
  EXPECT_TRUE(set->sections().empty() || set->sections() == std::vector<std::string>{"somata"});
}

TEST(CellAttributes, SurviveAdditionRemovalAndCompaction) {
  const TempFolder folder;
  const std::vector<Cell> all = columnWithAttributes(30);
  makeAttributed(all, folder / "all.fil");
  const auto expected = attributesOfSet(folder / "all.fil");
  makeAttributed({all.begin(), all.begin() + 27}, folder / "a.fil");
  addAttributed({all.begin() + 27, all.end()}, folder / "a.fil");
  EXPECT_EQ(attributesOfSet(folder / "a.fil"), expected);
  EXPECT_TRUE(verify(folder / "a.fil", {.deep = true}).sound());
  compactSet(folder / "a.fil");
  EXPECT_EQ(bytesOfFiles(folder / "a.fil"), bytesOfFiles(folder / "all.fil"));

  std::vector<std::string> gone;
  std::vector<Cell> rest;
  for (std::uint32_t c = 0; c < 30; ++c) {
    if (c < 9 && c != 1)
      gone.push_back(TileSet::open(folder / "all.fil")->cell(c).name);
    else
      rest.push_back(all[c]);
  }
  removeCells(gone, folder / "a.fil");
  auto left = expected;
  for (const std::string& name : gone) left.erase(name);
  EXPECT_EQ(attributesOfSet(folder / "a.fil"), left);
  EXPECT_TRUE(verify(folder / "a.fil", {.deep = true}).sound());
  compactSet(folder / "a.fil");
  makeAttributed(rest, folder / "rest.fil");
  EXPECT_EQ(bytesOfFiles(folder / "a.fil"), bytesOfFiles(folder / "rest.fil"));
}

TEST(CellAttributes, AnAdditionThatIsNotSmallKeepsThem) {
  const TempFolder folder;
  const std::vector<Cell> all = columnWithAttributes(12);
  makeAttributed(all, folder / "all.fil");
  makeAttributed({all.begin(), all.begin() + 3}, folder / "a.fil");
  addAttributed({all.begin() + 3, all.end()}, folder / "a.fil");
  EXPECT_EQ(bytesOfFiles(folder / "a.fil"), bytesOfFiles(folder / "all.fil"));
}

TEST(CellAttributes, TypesOfAColumnAreJoined) {
  const TempFolder folder;
  std::vector<Cell> all = test::randomColumn(3, 3, 5, 50);
  all[0].attributes = {
      {"exact", std::int64_t{3}}, {"large", INT64_MAX}, {"word", std::int64_t{12}}, {"nan", std::nan("")}};
  all[1].attributes = {{"exact", 0.5}, {"large", 0.5}, {"word", "x"}, {"empty", AttributeValue{}}};
  all[2].attributes = {{"exact", std::int64_t{4}}, {"word", 2.25}, {"word", "second of one name"}};
  makeAttributed(all, folder / "a.fil");
  const auto table = attributesOfSet(folder / "a.fil");
  const auto set = TileSet::open(folder / "a.fil");
  EXPECT_EQ(table.at(set->cell(0).name),
            (std::map<std::string, std::string>{{"exact", "3"}, {"large", "9223372036854775807"}, {"word", "12"}}));
  EXPECT_EQ(table.at(set->cell(1).name),
            (std::map<std::string, std::string>{{"exact", "0.5"}, {"large", "0.5"}, {"word", "x"}}));
  EXPECT_EQ(table.at(set->cell(2).name), (std::map<std::string, std::string>{{"exact", "4"}, {"word", "2.25"}}));
  EXPECT_EQ(CellAttributes(*set).columns()[0].type, AttributeType::real);
}

TEST(CellAttributes, EveryDamagedByteIsFound) {
  const TempFolder folder;
  makeAttributed(columnWithAttributes(10), folder / "a.fil");
  const std::string file =
      folder / ("a.fil/" + TileSet::open(folder / "a.fil")->revision() + "/section-attributes.bin");
  const std::string good = test::readBytes(file);
  for (std::size_t at = 0; at < good.size(); ++at) {
    std::string bad = good;
    bad[at] = static_cast<char>(bad[at] ^ 0x41);
    test::writeBytes(file, bad);
    const auto set = TileSet::open(folder / "a.fil");
    EXPECT_THROW(CellAttributes(*set).check(), std::runtime_error) << at;
  }
  test::writeBytes(file, good.substr(0, good.size() / 2));
  EXPECT_THROW(CellAttributes(*TileSet::open(folder / "a.fil")).check(), std::runtime_error);
}

TEST(CellAttributes, TextOfTablesHasTheNarrowestType) {
  EXPECT_TRUE(isMissing(attributeFrom("")));
  for (const char* const integer : {"0", "-12", "720575940626286432", "-9223372036854775808"})
    EXPECT_EQ(std::get<std::int64_t>(attributeFrom(integer)), std::stoll(integer));
  for (const char* const real : {"1.5", "-0.25", "1e5", ".5", "2.0"})
    EXPECT_EQ(std::get<double>(attributeFrom(real)), std::stod(real));
  for (const char* const text :
       {"007", "+1", "1,5", "nan", "inf", "1.5 um", "0x10", "-", "18446744073709551615", "1e999", "L5"})
    EXPECT_EQ(std::get<std::string>(attributeFrom(text)), text);
}

TEST(CellFilter, SelectsByTextNumberAndAbsence) {
  const TempFolder folder;
  const std::vector<Cell> all = columnWithAttributes(30);
  makeAttributed(all, folder / "a.fil");
  const auto set = TileSet::open(folder / "a.fil");
  const CellAttributes attributes(*set);
  const auto select = [&](std::vector<std::string> conditions) {
    return CellFilter(conditions).select(*set, attributes);
  };
  const auto expected = [&](auto meets) {
    std::vector<std::uint32_t> cells;
    for (std::uint32_t c = 0; c < 30; ++c)
      if (meets(c, c % 7 != 3)) cells.push_back(c);
    return cells;
  };
  EXPECT_EQ(select({"mtype=L2_TPC:A"}), expected([](auto c, bool there) { return there && c % 5 == 2 && c % 2 == 0; }));
  EXPECT_EQ(select({"mtype=L2_*"}), expected([](auto c, bool there) { return there && c % 5 == 2; }));
  EXPECT_EQ(select({"mtype!=L2_*"}), expected([](auto c, bool there) { return !there || c % 5 != 2; }));
  EXPECT_EQ(select({"mtype="}), expected([](auto, bool there) { return !there; }));
  EXPECT_EQ(select({"layer=-1"}), expected([](auto c, bool there) { return there && c % 6 == 0; }));
  EXPECT_EQ(select({"layer>=3", "depth um<4"}),
            expected([](auto c, bool there) { return there && c % 6 >= 4 && c < 16; }));
  EXPECT_EQ(select({"layer!=0"}), expected([](auto c, bool there) { return !there || c % 6 != 1; }));
  EXPECT_EQ(select({"attribute:mtype=L2_*", "attribute:layer=-1"}), select({"mtype=L2_*", "layer=-1"}));
  EXPECT_EQ(select({}), expected([](auto, bool) { return true; }));
  for (const char* const wrong : {"mtype", "=3", "mtype!3", "layer<x", "", "layer>"})
    EXPECT_THROW(CellFilter({wrong}), UsageError) << wrong;
  EXPECT_THROW(select({"nothing=1"}), UsageError);
  EXPECT_THROW(select({"mtype<3"}), UsageError);
}

// Both are 720575940621039104 as a double.
TEST(CellFilter, IntegersKeepAllDigits) {
  const TempFolder folder;
  std::vector<Cell> cells{test::randomNeuron(1), test::randomNeuron(2)};
  cells[0].attributes = {{"root", std::int64_t{720575940621039145}}};
  cells[1].attributes = {{"root", std::int64_t{720575940621039146}}};
  makeAttributed(cells, folder / "a.fil");
  const auto set = TileSet::open(folder / "a.fil");
  const CellAttributes attributes(*set);
  const auto count = [&](const std::string& condition) {
    return CellFilter({condition}).select(*set, attributes).size();
  };
  EXPECT_EQ(count("root=720575940621039145"), 1u);
  EXPECT_EQ(count("root!=720575940621039145"), 1u);
  EXPECT_EQ(count("root=720575940621039144"), 0u);
  EXPECT_EQ(count("root>720575940621039145"), 1u);
  EXPECT_EQ(count("root>=720575940621039145"), 2u);
  EXPECT_EQ(count("root<720575940621039145.5e3"), 2u);
}

TEST(ExactNumbers, AreOnlyTextsThatReadBack) {
  const auto text = [](const std::vector<std::string>& texts) {
    std::string all;
    const auto numbers = exactNumbers(texts);
    if (!numbers) return std::string("text");
    for (const AttributeValue& value : *numbers) all += (isMissing(value) ? "-" : textOf(value)) + " ";
    return all;
  };
  EXPECT_EQ(text({"6", "1", "", "-2"}), "6 1 - -2 ");
  EXPECT_EQ(text({"1,5", "2"}), "1.5 2 ");
  EXPECT_EQ(text({"1.5", "2"}), "1.5 2 ");
  EXPECT_EQ(text({"9007199254740992"}), "9007199254740992 ");
  for (const std::vector<std::string>& texts : std::vector<std::vector<std::string>>{{"007", "1"},
                                                                                     {"1.50"},
                                                                                     {"1e5"},
                                                                                     {"+1"},
                                                                                     {" 1"},
                                                                                     {"6", "L6"},
                                                                                     {"9007199254740993"},
                                                                                     {"1,234"},
                                                                                     {""},
                                                                                     {},
                                                                                     {"nan"}})
    EXPECT_EQ(text(texts), "text") << (texts.empty() ? "" : texts.front());
}

}  // namespace
}  // namespace filiform
