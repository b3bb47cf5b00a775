// Segment properties: what each kind of attribute becomes.
#include "index/export/skeleton_properties.h"

#include "index/formats/neuroglancer/internal/segment_properties.h"
#include "index/ingest/ingest.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/temp_folder.h"

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform {
namespace {

std::map<std::string, nlohmann::json> propertiesById(const std::string& text) {
  std::map<std::string, nlohmann::json> properties;
  const nlohmann::json parsed = nlohmann::json::parse(text);
  for (const auto& property : parsed.at("inline").at("properties")) properties[property.at("id")] = property;
  return properties;
}

TEST(SkeletonProperties, EachKindOfAttributeHasItsProperty) {
  const test::TempFolder folder;
  std::vector<Cell> cells = test::randomColumn(7, 3, 40, 150);
  cells[0].attributes = {{"mtype", "L5 TPC"},
                         {"layer", std::int64_t{5}},
                         {"depth", 0.5},
                         {"some", std::int64_t{7}},
                         {"root", std::int64_t{720575940621039145}}};
  cells[1].attributes = {{"mtype", "BC"},
                         {"layer", std::int64_t{-1}},
                         {"depth", 2.0},
                         {"etype", "b"},
                         {"root", std::int64_t{720575940621039146}}};
  cells[2].attributes = {{"mtype", "L5 TPC"}, {"layer", std::int64_t{2}}, {"depth", 1.0}, {"root", std::int64_t{3}}};
  std::map<std::string, std::string> types;
  for (const Cell& cell : cells) types[cell.source] = std::get<std::string>(cell.attributes.front().value);
  CellList stream(cells);
  ingest(stream, folder / "a.fil", {});
  const auto set = TileSet::open(folder / "a.fil");
  const CellAttributes attributes(*set);
  const std::string text = skeletonProperties(*set, {{1, 0}, {2, 1}, {3, 2}}, &attributes);
  const auto properties = propertiesById(text);
  EXPECT_EQ(properties.at("label").at("type"), "label");
  EXPECT_EQ(properties.at("layer").at("data_type"), "int32");
  EXPECT_EQ(properties.at("depth").at("data_type"), "float32");
  EXPECT_EQ(properties.at("some").at("type"), "string") << "not all cells have it";
  EXPECT_EQ(properties.at("root").at("type"), "string") << "no number of Neuroglancer holds all digits";
  EXPECT_NE(text.find("\"720575940621039145\""), std::string::npos);
  const auto& tags = properties.at("tags");
  EXPECT_EQ(tags.at("tags"), (nlohmann::json{"etype=b", "mtype=BC", "mtype=L5_TPC"}));
  for (std::uint32_t cell = 0; cell < 3; ++cell) {
    const bool basket = types.at(set->cell(cell).source) == "BC";
    EXPECT_EQ(tags.at("values").at(cell), basket ? (nlohmann::json{0, 1}) : nlohmann::json::array({2}));
    EXPECT_EQ(properties.at("layer").at("values").at(cell).get<int>() == -1, basket);
    EXPECT_EQ(properties.at("samples").at("values").at(cell), set->cell(cell).samples);
  }
  EXPECT_EQ(tags.at("tag_descriptions"), (nlohmann::json{"etype=b", "mtype=BC", "mtype=L5 TPC"}));
  // They come back with their types.
  const SegmentProperties back(text, "info");
  for (std::uint32_t cell = 0; cell < 3; ++cell) {
    Cell read;
    back.apply(cell + 1, read);
    EXPECT_EQ(read.name, set->cell(cell).name);
    std::map<std::string, AttributeValue> found;
    for (const CellAttribute& attribute : read.attributes) found[attribute.name] = attribute.value;
    EXPECT_EQ(found.at("source"), AttributeValue(set->cell(cell).source));
    EXPECT_EQ(found.at("id"), AttributeValue(std::int64_t{cell + 1}));
    EXPECT_FALSE(found.contains("samples"));
    found.erase("source");
    found.erase("id");
    std::map<std::string, AttributeValue> stored;
    for (const CellAttribute& attribute : attributes.of(cell)) stored[attribute.name] = attribute.value;
    EXPECT_EQ(found, stored);
  }
  // Without attributes only what every set has.
  EXPECT_EQ(propertiesById(skeletonProperties(*set, {{1, 0}}, nullptr)).size(), 5u);
}

TEST(SkeletonProperties, ATextThatNoTagHoldsIsAString) {
  const test::TempFolder folder;
  std::vector<Cell> cells = test::randomColumn(7, 2, 40, 150);
  cells[0].attributes = {{"a=b", "x"}, {"kind", "L5 PC"}, {"label", "l"}, {"tags", "t"}, {"samples", "many"}};
  cells[1].attributes = {{"a=b", "y"}, {"kind", "L5_PC"}, {"label", "m"}, {"tags", "u"}, {"samples", "few"}};
  CellList stream(cells);
  ingest(stream, folder / "a.fil", {});
  const auto set = TileSet::open(folder / "a.fil");
  const CellAttributes attributes(*set);
  const std::string text = skeletonProperties(*set, {{1, 0}, {2, 1}}, &attributes);
  const auto properties = propertiesById(text);
  EXPECT_EQ(properties.at("a=b").at("type"), "string");
  EXPECT_EQ(properties.at("kind").at("type"), "string") << "two texts have one tag";
  EXPECT_EQ(properties.at("label_").at("type"), "label");
  EXPECT_EQ(properties.at("tags_").at("type"), "tags");
  const SegmentProperties back(text, "info");
  for (std::uint32_t cell = 0; cell < 2; ++cell) {
    Cell read;
    back.apply(cell + 1, read);
    EXPECT_EQ(read.name, set->cell(cell).name);
    for (const CellAttribute& stored : attributes.of(cell)) {
      const auto same = std::find_if(read.attributes.begin(), read.attributes.end(),
                                     [&](const CellAttribute& a) { return a.name == stored.name; });
      ASSERT_NE(same, read.attributes.end()) << stored.name;
      EXPECT_EQ(same->value, stored.value) << stored.name;
    }
  }
}

}  // namespace
}  // namespace filiform
