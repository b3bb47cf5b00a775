#include "index/formats/internal/nml.h"

#include "index/input/input.h"
#include "tests/support/temp_folder.h"
#include "tests/support/zip_builder.h"

#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

const std::string kScaledByTen =
    "<parameters><experiment name=\"e\"/><scale x=\"10\" y=\"20\" z=\"40\"/></parameters>\n";

std::string treeText(const std::string& attributes, const std::string& nodes, const std::string& edges) {
  return "<thing " + attributes + "><nodes>" + nodes + "</nodes><edges>" + edges + "</edges></thing>\n";
}
const std::string kTwoNodes =
    "<node id=\"1\" radius=\"3\" x=\"100\" y=\"200\" z=\"30\"/><node id=\"2\" x=\"110\" y=\"200\" z=\"30\"/>";
const std::string kOneEdge = "<edge source=\"1\" target=\"2\"/>";

std::string fileText(const std::string& trees, const std::string& parameters = kScaledByTen) {
  return "<?xml version=\"1.0\"?>\n<things>" + parameters + trees + "</things>\n";
}

struct NmlReading {
  std::vector<Cell> cells;
  std::string table, reason;
};

NmlReading readNmlInput(const std::string& path, const InputOptions& options = {}) {
  Input input({path}, options);
  NmlReading reading;
  for (Cell cell; input.next(cell);) reading.cells.push_back(cell);
  std::ostringstream table;
  writeCheckTable(table, input.reports());
  reading.table = table.str().substr(table.str().find('\n') + 1);
  forEachInput(input.reports(), [&](const std::string&, const InputReport&, const InputOutcome& outcome) {
    if (reading.reason.empty()) reading.reason = outcome.reason;
  });
  return reading;
}

NmlReading readNmlText(const std::string& text, const InputOptions& options = {}) {
  const test::TempFolder folder;
  test::writeBytes(folder.file("a.nml"), text);
  return readNmlInput(folder.file("a.nml"), options);
}

TEST(Nml, OneCellATreeInVoxelsOfTheScale) {
  const NmlReading reading =
      readNmlText(fileText(treeText("id=\"1\" name=\"x &amp; y/z\"", kTwoNodes, kOneEdge) +
                           treeText("id=\"2\"", "<node id=\"5\" x=\"0\" y=\"0\" z=\"0\"/>", "")));
  EXPECT_EQ(reading.table, "a.nml\taccept\t3\t1\t-\t-\n");
  ASSERT_EQ(reading.cells.size(), 2u);
  EXPECT_EQ(reading.cells[0].source, "a.nml/2");
  const Cell& cell = reading.cells[1];
  EXPECT_EQ(cell.source, "a.nml/x & y_z");
  EXPECT_EQ(cell.sample_ids, (std::vector<std::int64_t>{1, 2}));
  EXPECT_TRUE(cell.positions_um[0].isApprox(Vector3d(1, 4, 1.2)));
  EXPECT_FLOAT_EQ(cell.radii_um[0], 0.03f);
  EXPECT_TRUE(std::isnan(cell.radii_um[1]));
}

TEST(Nml, AllListsOfNodesAndEdgesOfATreeAreRead) {
  const std::string tree =
      "<thing id=\"1\"><nodes><node id=\"1\" x=\"1\" y=\"2\" z=\"3\"/></nodes><edges/>"
      "<nodes><node id=\"2\" x=\"4\" y=\"2\" z=\"3\"/></nodes><edges>" +
      kOneEdge + "</edges></thing>";
  const std::string comment = "<comments><comment node=\"2\" content=\"spine\"/></comments>";
  EXPECT_EQ(readNmlText(fileText(tree + comment)).table, "a.nml\twarn\t2\t1\t-\tW_ELEMENT:1\n");
}

TEST(Nml, AnUnknownUnitOfScaleIsNamed) {
  const std::string parameters = "<parameters><scale x=\"1\" y=\"1\" z=\"1\" unit=\"parsec\"/></parameters>";
  EXPECT_EQ(readNmlText(fileText(treeText("id=\"1\"", kTwoNodes, kOneEdge), parameters)).reason,
            "unknown unit of scale: parsec");
}

TEST(Nml, LoopsAreKept) {
  const NmlReading reading =
      readNmlText(fileText(treeText("id=\"1\"", kTwoNodes + "<node id=\"3\" x=\"1\" y=\"1\" z=\"1\"/>",
                                    kOneEdge + "<edge source=\"2\" target=\"3\"/><edge source=\"3\" target=\"1\"/>")));
  EXPECT_EQ(reading.table, "a.nml\taccept\t3\t3\t-\t-\n");
}

TEST(Nml, CommentsAndBranchPointsAreCountedWithTheirTree) {
  const std::string other = "<node id=\"5\" x=\"0\" y=\"0\" z=\"0\"/>";
  const NmlReading reading = readNmlText(
      fileText(treeText("id=\"1\" name=\"a\"", kTwoNodes, kOneEdge) + treeText("id=\"2\" name=\"b\"", other, "") +
               "<branchpoints><branchpoint id=\"1\"/></branchpoints>"
               "<comments><comment node=\"2\" content=\"x\"/><comment node=\"5\" content=\"y\"/></comments>"));
  EXPECT_EQ(reading.table, "a.nml\twarn\t3\t1\t-\tW_ELEMENT:3\n");
}

TEST(Nml, BadNodesAndEdgesAreRecords) {
  const NmlReading reading = readNmlText(fileText(
      treeText("id=\"1\" name=\"a\"",
               kTwoNodes + "<node id=\"3\" x=\"1\" y=\"1\"/><node id=\"q\" x=\"1\" y=\"1\" z=\"1\"/><node id=\"4\" "
                           "x=\"1\" y=\"nan\" z=\"1\"/>"
                           "<node id=\"5\" x=\"1\" y=\"t\" z=\"1\"/><node id=\"2\" x=\"1\" y=\"1\" z=\"1\"/><node "
                           "id=\"6\" radius=\"-1\" x=\"1\" y=\"1\" z=\"1\"/>"
                           "<node id=\"7\" radius=\"1\" x=\"1\" y=\"1\" z=\"2\"/>",
               kOneEdge + "<edge source=\"1\" target=\"9\"/><edge source=\"1\"/><edge source=\"1\" target=\"1\"/>")));
  EXPECT_EQ(reading.table,
            "a.nml\twarn\t4\t1\ta:3,a:4,a:5,a:6,a:7\tW_BAD_ID:1,W_BAD_LINE:1,W_BAD_PARENT:1,W_BAD_RADIUS:1,W_DUP_ID:1,"
            "W_MISSING_PARENT:1,W_NONFINITE:1,W_SELF_PARENT:1,W_SHORT_LINE:1\n");
}

TEST(Nml, TheScaleHasAUnitAndMustBeThere) {
  const std::string tree = treeText("id=\"1\"", kTwoNodes, kOneEdge);
  const auto place = [&](const std::string& parameters, const InputOptions& options = {}) {
    const NmlReading reading = readNmlText(fileText(tree, parameters), options);
    return reading.cells.empty() ? Vector3d(0, 0, 0) : reading.cells[0].positions_um[0];
  };
  EXPECT_TRUE(place("<parameters><scale x=\"1\" y=\"1\" z=\"1\" unit=\"micrometer\"/></parameters>")
                  .isApprox(Vector3d(100, 200, 30)));
  EXPECT_EQ(readNmlText(fileText(tree, "")).reason, "no scale; give the voxel size by --unit");
  EXPECT_EQ(readNmlText(fileText(tree, "<parameters><scale x=\"1\" y=\"0\" z=\"1\"/></parameters>")).reason,
            "NML whose scale is no size of a voxel");
  InputOptions options;
  options.swc.voxel_um = Vector3d(0.01, 0.01, 0.03);
  EXPECT_TRUE(place("", options).isApprox(Vector3d(1, 2, 0.9)));
  options.swc.apply_offset = true;
  EXPECT_TRUE(
      place("<parameters><scale x=\"10\" y=\"10\" z=\"10\"/><offset x=\"1\" y=\"0\" z=\"0\"/></parameters>", options)
          .isApprox(Vector3d(1.01, 2, 0.3)));
}

TEST(Nml, OtherXmlIsRefusedByName) {
  const auto reason = [](const std::string& text) { return readNmlText(text).reason.substr(0, 40); };
  EXPECT_EQ(reason("<?xml version=\"1.0\"?><neuroml xmlns=\"x\"/>"), "NeuroML, not the NML of KNOSSOS or webKn");
  EXPECT_EQ(reason("<mbf version=\"4\"/>"), "Neurolucida XML, not the NML of KNOSSOS ");
  EXPECT_EQ(reason("1 1 0 0 0 5 -1\n").substr(0, 6), "no XML");
  EXPECT_EQ(reason(fileText(treeText("id=\"1\"", kTwoNodes, kOneEdge)).substr(0, 200)).substr(0, 4), "byte");
}

TEST(Nml, EntitiesAreNotExpanded) {
  std::string text = "<!DOCTYPE things [<!ENTITY a \"aaaaaaaaaa\">";
  for (char c = 'b'; c < 'k'; ++c) {
    text += std::string("<!ENTITY ") + c + " \"";
    for (int i = 0; i < 10; ++i) text += std::string("&") + static_cast<char>(c - 1) + ";";
    text += "\">";
  }
  text += "]>\n" + fileText(treeText("id=\"1\" name=\"&j;\"", kTwoNodes, kOneEdge)).substr(22);
  const NmlReading reading = readNmlText(text);
  ASSERT_EQ(reading.cells.size(), 1u);
  EXPECT_EQ(reading.cells[0].source, "a.nml/&j;");
}

TEST(Nml, AKnossosArchiveGivesItsTrees) {
  const test::TempFolder folder;
  const std::string text = fileText(treeText("id=\"1\" name=\"t\"", kTwoNodes, kOneEdge));
  test::writeBytes(folder.file("a.k.zip"),
                   test::buildZip({test::zipMember("annotation.xml", text), test::zipMember("mergelist.txt", "x")}));
  const NmlReading reading = readNmlInput(folder.file("a.k.zip"));
  EXPECT_EQ(reading.table, "a.k.zip\taccept\t2\t1\t-\t-\n");
  ASSERT_EQ(reading.cells.size(), 1u);
  EXPECT_EQ(reading.cells[0].source, "a.k.zip/annotation.xml/t");
}

}  // namespace
}  // namespace filiform
