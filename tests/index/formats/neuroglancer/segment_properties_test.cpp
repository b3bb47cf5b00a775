// Segment properties: what each kind becomes, and what is refused.
#include "index/formats/neuroglancer/internal/segment_properties.h"

#include "index/errors.h"
#include "index/input/input.h"
#include "tests/support/temp_folder.h"

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

std::string propertiesOf(const std::string& ids, const std::string& properties) {
  return R"({"@type": "neuroglancer_segment_properties", "inline": {"ids": [)" + ids + R"(], "properties": [)" +
         properties + "]}}";
}

// "name NAME=VALUE ..." of an object; a text is in quotation marks.
std::string namedBy(const SegmentProperties& properties, std::uint64_t id) {
  Cell cell;
  properties.apply(id, cell);
  std::string text = cell.name;
  for (const CellAttribute& attribute : cell.attributes) {
    const bool is_text = typeOf(attribute.value) == AttributeType::text;
    text += " " + attribute.name + "=" + (is_text ? "\"" + textOf(attribute.value) + "\"" : textOf(attribute.value));
    if (typeOf(attribute.value) == AttributeType::real) text += "r";
  }
  return text;
}

TEST(SegmentProperties, EachKindBecomesANameOrAnAttribute) {
  const SegmentProperties properties(
      propertiesOf(R"("7", "720575940600000001", "3")",
                   R"({"id": "label", "type": "label", "values": ["neuron seven", "big", ""]},
                      {"id": "about", "type": "description", "values": ["from a paper", "", null]},
                      {"id": "cell_type", "type": "string", "values": ["L5PC", "", "5"]},
                      {"id": "root", "type": "string", "description": "integer", "values": ["12", "x", ""]},
                      {"id": "layer", "type": "number", "data_type": "uint8", "values": [5, 4.0, null]},
                      {"id": "depth", "type": "number", "data_type": "float32", "values": [1, 0.25, -3]},
                      {"id": "samples", "type": "number", "data_type": "uint32", "description": "counted by filiform",
                       "values": [1, 1, 1]},
                      {"id": "marks", "type": "tags", "tags": ["axon", "mtype=L5_TPC", "mtype=BC", "proofread", "depth=9"],
                       "tag_descriptions": ["has one", "mtype=L5 TPC", "a basket cell", "", ""],
                       "values": [[0, 1, 3], [1, 2], [4]]})"),
      "info");
  EXPECT_EQ(properties.ids(), (std::vector<std::uint64_t>{3, 7, 720575940600000001}));
  EXPECT_TRUE(properties.leftOut().empty());
  EXPECT_EQ(namedBy(properties, 7),
            R"(neuron seven id=7 about="from a paper" cell_type="L5PC" root=12 layer=5 depth=1r marks="axon proofread")"
            R"( mtype="L5 TPC")");
  EXPECT_EQ(namedBy(properties, 720575940600000001),
            R"(big id=720575940600000001 root="x" layer=4 depth=0.25r mtype="L5 TPC BC")");
  EXPECT_EQ(namedBy(properties, 3), R"( id=3 cell_type="5" depth=-3r marks="depth=9")") << "depth is taken";
  EXPECT_EQ(namedBy(properties, 4), " id=4") << "not listed";
}

TEST(SegmentProperties, AnIdKeepsAllItsDigits) {
  const SegmentProperties large(propertiesOf(R"("18446744073709551615", "1")", ""), "info");
  EXPECT_EQ(namedBy(large, UINT64_MAX), R"( id="18446744073709551615")");
  EXPECT_EQ(namedBy(large, 1), R"( id="1")") << "one type for the column";
  const SegmentProperties taken(
      propertiesOf(R"("1")", R"({"id": "id", "type": "string", "description": "integer", "values": ["42"]})"), "info");
  EXPECT_EQ(namedBy(taken, 1), " id=42");
}

TEST(SegmentProperties, AKindThatIsNotKnownIsNamed) {
  const SegmentProperties properties(propertiesOf(R"("1")", R"({"id": "shape", "type": "vector", "values": [[1, 2]]})"),
                                     "info");
  EXPECT_EQ(properties.leftOut(), std::vector<std::string>{"shape"});
  EXPECT_TRUE(SegmentProperties(R"({"@type": "neuroglancer_segment_properties"})", "info").ids().empty());
}

TEST(SegmentProperties, ASecondLabelIsLeftOut) {
  const SegmentProperties properties(propertiesOf(R"("1")", R"({"id": "a", "type": "label", "values": ["first"]},
                                                               {"id": "b", "type": "label", "values": ["second"]})"),
                                     "info");
  EXPECT_EQ(namedBy(properties, 1), "first id=1");
  EXPECT_EQ(properties.leftOut(), std::vector<std::string>{"b"});
}

TEST(SegmentProperties, BracketsInTextsAreNoNesting) {
  std::string label = R"(\\\"\\)";
  for (int i = 0; i < 100; ++i) label += "[{";
  const SegmentProperties properties(
      propertiesOf(R"("1")", R"({"id": "a", "type": "label", "values": [")" + label + "\"]}"), "info");
  EXPECT_TRUE(namedBy(properties, 1).starts_with(R"(\"\[{[{)")) << namedBy(properties, 1);
}

TEST(SegmentProperties, RefusesWhatContradictsItself) {
  const auto text = [](const std::string& property) { return propertiesOf(R"("1", "2")", property); };
  for (
      const auto& [json, reason] : std::vector<std::pair<std::string, std::string>>{
          {"no json", "is not the info of segment properties: no valid JSON"},
          {"[\"" + std::string(1000, ']') + "\", " + std::string(1000, '[') + std::string(1001, ']'),
           "at most 64 levels"},
          {"[]", "is not the info of segment properties"},
          {std::string(1000, '['), "is not the info of segment properties"},
          {R"({"inline": {"ids": 3}})", "holds no list inline.ids"},
          {propertiesOf(R"("1", "x")", ""), "id 2 is not a text of decimal digits"},
          {propertiesOf("1", ""), "id 1 is not a text of decimal digits"},
          {text(R"({"type": "label", "values": ["a", "b"]})"), "one of its properties has no id"},
          {text(R"({"id": "a", "type": "label", "values": ["a"]})"), "property a has not one value for each of its 2"},
          {text(R"({"id": "a", "type": "number", "values": [1, "2"]})"), "value of its property a has the wrong type"},
          {text(R"({"id": "a", "type": "string", "values": ["", []]})"), "value of its property a has the wrong type"},
          {text(
               R"({"id": "a", "type": "string", "values": ["", ""]}, {"id": "a", "type": "number", "values": [1, 2]})"),
           "two properties have the id a; rename one of them"},
          {text(R"({"id": "t", "type": "tags", "values": [[], []]})"), "its tags are not a list"},
          {text(R"({"id": "t", "type": "tags", "tags": ["a"], "values": [[0], [1]]})"), "of its tags names none"},
          {text(R"({"id": "t", "type": "tags", "tags": ["a"], "values": [[0], 0]})"), "of its tags is not a list"}}) {
    try {
      const SegmentProperties properties(json, "info");
      FAIL() << json;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find("info: "), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find(reason), std::string::npos) << error.what();
    }
  }
}

// A skeleton of one node.
const std::string kNode("\1\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0", 20);

TEST(SegmentProperties, NameTheCellsOfAFolder) {
  const test::TempFolder folder;
  std::filesystem::create_directories(folder.file("s/names"));
  test::writeBytes(folder.file("s/info"), R"({"@type": "neuroglancer_skeletons", "segment_properties": "names"})");
  for (const char* const id : {"1", "3", "5", "18446744073709551616"})  // the last is no id
    test::writeBytes(folder.file(std::string("s/") + id), kNode);
  const auto read = [&] {
    std::map<std::string, std::string> cells;
    Input input({folder.file("s")});
    for (Cell cell; input.next(cell);) {
      std::string& text = cells[cell.source] = cell.name;
      for (const CellAttribute& attribute : cell.attributes)
        text += " " + attribute.name + "=" + textOf(attribute.value);
    }
    return cells;
  };
  using Cells = std::map<std::string, std::string>;
  EXPECT_EQ(read(), (Cells{{"1", ""}, {"3", ""}, {"5", ""}})) << "the folder of properties has no info";
  test::writeBytes(folder.file("s/names/info"),
                   propertiesOf(R"("1", "3")", R"({"id": "label", "type": "label", "values": ["one", "three"]},
                                                  {"id": "kind", "type": "string", "values": ["a", "b"]})"));
  EXPECT_EQ(read(), (Cells{{"1", "one id=1 kind=a"}, {"3", "three id=3 kind=b"}, {"5", " id=5"}}));
  test::writeBytes(folder.file("s/names/info"), "{");
  EXPECT_THROW(read(), InputError);
}

}  // namespace
}  // namespace filiform
