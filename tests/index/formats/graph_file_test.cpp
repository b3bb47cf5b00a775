#include "index/formats/internal/graph_file.h"

#include "index/errors.h"
#include "index/export/cell_formats.h"
#include "index/input/input.h"
#include "index/query/cell_graph.h"
#include "tests/support/graph_reading.h"
#include "tests/support/temp_folder.h"

#include <bit>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <random>
#include <sstream>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::GraphReading;
using test::readAs;
using test::readingRow;
using Links = std::vector<std::array<std::uint32_t, 2>>;

std::string edges(const std::string& text, const GraphOptions& options = {}) {
  return readingRow(readAs(GraphFormat::kEdgeList, text, options));
}
std::string obj(const std::string& text) { return readingRow(readAs(GraphFormat::kObjLines, text)); }
std::string vtk(const std::string& text) { return readingRow(readAs(GraphFormat::kVtkPolylines, text)); }

const std::string kTriangle =
    "# a ring\nnode 10 0 0 0 1 3\nnode 20 4 0 0\nnode 30\t0 3 0 nan\nedge 10 20\nedge 20 30\nedge 30 10\n";

TEST(EdgeList, KeepsLoopsIdsRadiiAndTypes) {
  const GraphReading ring = readAs(GraphFormat::kEdgeList, kTriangle);
  EXPECT_EQ(readingRow(ring), "accept 3 3 0 0");
  EXPECT_EQ(ring.cell.sample_ids, (std::vector<std::int64_t>{10, 20, 30}));
  EXPECT_EQ(ring.cell.links, (Links{{1, 0}, {2, 1}, {2, 0}}));
  EXPECT_EQ(ring.cell.positions_um[1], Vector3d(4, 0, 0));
  EXPECT_EQ(ring.cell.radii_um[0], 1);
  EXPECT_TRUE(std::isnan(ring.cell.radii_um[1]));
  EXPECT_TRUE(std::isnan(ring.cell.radii_um[2]));
  EXPECT_EQ(ring.cell.types[0], 3);
  EXPECT_EQ(ring.report.roots, 1u);
  EXPECT_EQ(ring.report.isolated, 0u);
}

TEST(EdgeList, TakesLinesInAnyOrderAndAnyLineEnds) {
  const GraphReading tree = readAs(GraphFormat::kEdgeList,
                                   "\xEF\xBB\xBF"
                                   "edge 2 1\r\nnode 2 1 1 1\r\rnode 1 0 0 0 # root\r\n");
  EXPECT_EQ(readingRow(tree), "warn 2 1 0 0 W_BOM:1");
  EXPECT_FALSE(tree.cell.isGraph());
  EXPECT_EQ(tree.cell.parents, (std::vector<std::uint32_t>{kNoParent, 0}));
}

TEST(EdgeList, NamesEverythingThatItDropsOrCuts) {
  const std::string good = "node 1 0 0 0\nnode 2 1 0 0\nnode 3 2 0 0\nedge 1 2\nedge 2 3\n";
  EXPECT_EQ(edges(good + "node 1 5 5 5\n"), "warn 3 2 1 0 W_DUP_ID:1");
  EXPECT_EQ(edges(good + "node 4 5 5\n"), "warn 3 2 1 0 W_SHORT_LINE:1");
  EXPECT_EQ(edges(good + "node 4 5 5 nan\nedge 4 1\n"), "warn 3 2 1 1 W_MISSING_PARENT:1 W_NONFINITE:1");
  EXPECT_EQ(edges(good + "node 4 5 5 2e9\n"), "warn 3 2 1 0 W_RANGE:1");
  EXPECT_EQ(edges(good + "node x 5 5 5\nnode -1 5 5 5\nnode 1.5 0 0 0\n"), "warn 3 2 3 0 W_BAD_ID:2 W_BAD_LINE:1");
  EXPECT_EQ(edges(good + "node 4 5 5 5 -1 -1 7\n"), "warn 4 2 0 0 W_BAD_RADIUS:1 W_BAD_TYPE:1 W_EXTRA_COLUMNS:1");
  EXPECT_EQ(edges(good + "edge 1 1\nedge 1 9\nedge 1\nedge 1 x\nedge 1 2 3\n"),
            "warn 3 3 0 4 W_BAD_PARENT:1 W_EXTRA_COLUMNS:1 W_MISSING_PARENT:1 W_SELF_PARENT:1 W_SHORT_LINE:1");
  EXPECT_EQ(edges(good + "vertex 1\n"), "warn 3 2 1 0 W_BAD_LINE:1");
  EXPECT_EQ(edges(good + std::string("node 4 0 0 0\0\n", 14)), "warn 3 2 1 0 W_NUL:1");
  EXPECT_EQ(edges(good + "node 4 0 0 0" + std::string(70000, ' ') + "\n"), "warn 3 2 1 0 W_LONG_LINE:1");
  EXPECT_EQ(edges("edge 1 2\n"), "refuse 0 0 0 1 E_NO_SAMPLES:1 W_MISSING_PARENT:1");
  EXPECT_EQ(edges("node 1 0 0 0\nx\ny\n"), "refuse 0 0 2 0 E_MOSTLY_BAD:1 W_BAD_LINE:2");
  EXPECT_EQ(edges("\x1F\x8B whatever"), "refuse 0 0 0 0 E_NOT_TEXT:1");
  EXPECT_EQ(edges(good + "node 1 5 5 5\n", {.units = {.strict = true}, .skeleton = {}}).substr(0, 10), "refuse 0 0");
}

TEST(EdgeList, RecordsSayLineCodeAndToken) {
  const GraphReading reading = readAs(GraphFormat::kEdgeList, "node 1 0 0 0\n\nnode 2 0 0 z\x1b\nedge 1 7\n");
  ASSERT_EQ(reading.report.records.size(), 2u);
  EXPECT_EQ(reading.report.records[0].line, 3u);
  EXPECT_EQ(reading.report.records[0].token, "z\\x1b");
  EXPECT_EQ(reading.report.records[1].line, 4u);
  EXPECT_EQ(reading.report.records[1].token, "1 7");
}

TEST(EdgeList, TakesUnits) {
  const GraphReading nm =
      readAs(GraphFormat::kEdgeList, "node 1 1000 2000 3000 500\n", {.units = {.unit_um = 1e-3}, .skeleton = {}});
  EXPECT_EQ(nm.cell.positions_um[0], Vector3d(1, 2, 3));
  EXPECT_EQ(nm.cell.radii_um[0], 0.5f);
  const GraphReading voxels = readAs(GraphFormat::kEdgeList, "node 1 10 10 10 500\n",
                                     {.units = {.voxel_um = Vector3d(1, 2, 30)}, .skeleton = {}});
  EXPECT_EQ(voxels.cell.positions_um[0], Vector3d(10, 20, 300));
  EXPECT_EQ(voxels.cell.radii_um[0], 500);
  EXPECT_THROW(readAs(GraphFormat::kEdgeList, "", {.units = {.voxel_um = Vector3d(1, 0, 1)}, .skeleton = {}}),
               UsageError);
}

TEST(EdgeList, WritesWhatItReads) {
  CellGraph graph;
  graph.name = "ring";
  graph.sample_ids = {5, 7, 9, 11};
  graph.positions = {GridPoint(0, 0, 0), GridPoint(513, -1, 7), GridPoint(1, 1, 1), GridPoint(2, 2, 2)};
  graph.radii_um = {0.1f, kUnknownRadius, 2, 3};
  graph.types = {0, 3, 2, 65535};
  graph.links = {{1, 0}, {2, 1}, {2, 0}, {3, 3}};
  graph.parents = {kNoParent, 0, 0, kNoParent};
  std::ostringstream out;
  writeEdgeList(out, graph);
  const GraphReading back = readAs(GraphFormat::kEdgeList, out.str());
  EXPECT_EQ(readingRow(back), "accept 4 3 0 0");
  EXPECT_EQ(back.cell.sample_ids, graph.sample_ids);
  EXPECT_EQ(back.cell.links, graph.links);
  EXPECT_EQ(back.cell.types, graph.types);
  EXPECT_EQ(back.cell.radii_um[0], 0.1f);
  // The fewest decimals that read back as the grid point.
  for (std::uint32_t i = 0; i < 4; ++i) EXPECT_EQ(graph.grid.snap(back.cell.positions_um[i]), graph.positions[i]) << i;
  std::ostringstream swc;
  EXPECT_THROW(writeSwc(swc, graph), InputError);
}

TEST(ObjLines, ReadsPolylinesOfAllForms) {
  const GraphReading reading = readAs(GraphFormat::kObjLines,
                                      "# x\nmtllib a.mtl\no thing\nv 0 0 0\nv 1 0 0 1.0\nv 1 1 0 .5 .5 .5\nvt 0 0\n"
                                      "l 1/1 2/1 3\nv 5 5 5\n\tl -1 -2 \\\n 1\n");
  EXPECT_EQ(readingRow(reading), "accept 4 4 0 0");
  EXPECT_EQ(reading.cell.sample_ids, (std::vector<std::int64_t>{1, 2, 3, 4}));
  EXPECT_EQ(reading.cell.links, (Links{{1, 0}, {2, 1}, {3, 2}, {2, 0}}));
}

TEST(ObjLines, NamesWhatItLeavesOut) {
  const std::string good = "v 0 0 0\nv 1 0 0\nv 2 0 0\nl 1 2 3\n";
  EXPECT_EQ(obj(good + "f 1 2 3\np 1\n"), "warn 3 2 0 0 W_ELEMENT:2");
  EXPECT_EQ(obj(good + "l 1\nl\n"), "warn 3 2 0 2 W_SHORT_LINE:2");
  EXPECT_EQ(obj(good + "l 1 x 3\n"), "warn 3 2 0 2 W_BAD_PARENT:2");
  EXPECT_EQ(obj(good + "l 1 0 -9 99999999999999999999 3\n"), "warn 3 2 0 4 W_BAD_PARENT:4");
  EXPECT_EQ(obj(good + "l 1 4\nl 2 2\n"), "warn 3 2 0 2 W_MISSING_PARENT:1 W_SELF_PARENT:1");
  EXPECT_EQ(obj(good + "v 1 2\nv a b c\nl 5 1\n"), "warn 3 2 2 1 W_BAD_LINE:1 W_MISSING_PARENT:1 W_SHORT_LINE:1");
  EXPECT_EQ(obj("v 1 2 3"), "accept 1 0 0 0");
}

TEST(ObjLines, ALineMayBeLongerThanALineOfSwc) {
  std::string text, line = "l";
  for (int i = 1; i <= 30000; ++i) {
    text += "v " + std::to_string(i) + " 0 0\n";
    line += " " + std::to_string(i);
  }
  EXPECT_EQ(obj(text + line), "accept 30000 29999 0 0");
}

std::string bigEndian(std::uint64_t bits, std::size_t bytes) {
  std::string out;
  for (std::size_t i = bytes; i-- > 0;) out += static_cast<char>(bits >> (8 * i));
  return out;
}
std::string littleEndian(std::uint64_t bits, std::size_t bytes) {
  std::string out = bigEndian(bits, bytes);
  return {out.rbegin(), out.rend()};
}
std::uint64_t bitsOf(float value) { return std::bit_cast<std::uint32_t>(value); }

const std::string kVtk3 = "# vtk DataFile Version 3.0\na title\n";

std::string asciiVtk() {
  return kVtk3 +
         "ASCII\nDATASET POLYDATA\nPOINTS 4 float\n0 0 0 1 0 0\n1 1 0 0 1\n0\nLINES 2 7\n3 0 1 2\n2 2 3\n"
         "POINT_DATA 4\nSCALARS Radius float 1\nLOOKUP_TABLE default\n1 2 3 4\nVECTORS v float\n" +
         "0 0 0 0 0 0 0 0 0 0 0 0\nFIELD FieldData 1\nother 2 4 double\n1 2 3 4 5 6 7 8\n";
}

TEST(VtkPolylines, ReadsAscii) {
  const GraphReading reading = readAs(GraphFormat::kVtkPolylines, asciiVtk());
  EXPECT_EQ(readingRow(reading), "accept 4 3 0 0");
  EXPECT_EQ(reading.cell.parents, (std::vector<std::uint32_t>{kNoParent, 0, 1, 2}));
  EXPECT_EQ(reading.cell.positions_um[2], Vector3d(1, 1, 0));
  EXPECT_EQ(reading.cell.radii_um, (std::vector<float>{1, 2, 3, 4}));
}

std::string binaryVtk() {
  std::string text = kVtk3 + "BINARY\nDATASET POLYDATA\nPOINTS 3 double\n";
  for (const double x : {0.0, 0.0, 0.0, 1.5, 0.0, -0.25, 7.0, 8.0, 9.0})
    text += bigEndian(std::bit_cast<std::uint64_t>(x), 8);
  text += "\nPOLYGONS 1 4\n";
  for (const std::uint64_t i : {3u, 0u, 1u, 2u}) text += bigEndian(i, 4);
  text += "\nLINES 1 5\n";
  for (const std::uint64_t i : {4u, 0u, 1u, 2u, 0u}) text += bigEndian(i, 4);
  text += "\nCELL_DATA 1\nSCALARS radius int\nLOOKUP_TABLE default\n" + bigEndian(7, 4);
  text += "\nPOINT_DATA 3\nFIELD FieldData 2\nlabel 1 3 short\n" + bigEndian(1, 2) + bigEndian(2, 2) + bigEndian(3, 2);
  text += "\nMaximumInscribedSphereRadius 1 3 float\n" + bigEndian(bitsOf(0.5f), 4) + bigEndian(bitsOf(-1), 4) +
          bigEndian(bitsOf(2), 4) + "\n";
  return text;
}

TEST(VtkPolylines, ReadsBinary) {
  const GraphReading reading = readAs(GraphFormat::kVtkPolylines, binaryVtk());
  EXPECT_EQ(readingRow(reading), "warn 3 3 0 0 W_BAD_RADIUS:1 W_ELEMENT:1");
  EXPECT_EQ(reading.cell.links, (Links{{1, 0}, {2, 1}, {2, 0}}));
  EXPECT_EQ(reading.cell.positions_um[1], Vector3d(1.5, 0, -0.25));
  EXPECT_EQ(reading.cell.radii_um[0], 0.5f);
  EXPECT_TRUE(std::isnan(reading.cell.radii_um[1]));
}

TEST(VtkPolylines, ReadsOffsetsOfVersion5) {
  const std::string head = "# vtk DataFile Version 5.1\nvtk output\n";
  const GraphReading ascii =
      readAs(GraphFormat::kVtkPolylines,
             head +
                 "ASCII\nDATASET POLYDATA\nPOINTS 4 float\n0 0 0 1 0 0 1 1 0 0 1 0\n\n"
                 "METADATA\nINFORMATION 1\nNAME x LOCATION y\nDATA 1 2\n\nVERTICES 2 1\nOFFSETS vtktypeint64\n"
                 "0 1\nCONNECTIVITY vtktypeint64\n0\n"
                 "LINES 4 6\nOFFSETS vtktypeint64\n0 3 3 6 \nCONNECTIVITY vtktypeint64\n0 1 2 2 3 0\n");
  EXPECT_EQ(readingRow(ascii), "warn 4 4 0 0 W_ELEMENT:1");
  std::string text = head + "BINARY\nDATASET POLYDATA\nPOINTS 3 float\n";
  for (const float x : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 2.f, 0.f, 0.f}) text += bigEndian(bitsOf(x), 4);
  text += "\nLINES 2 3\nOFFSETS vtktypeint64\n" + bigEndian(0, 8) + bigEndian(3, 8) + "\nCONNECTIVITY vtktypeint64\n" +
          bigEndian(0, 8) + bigEndian(2, 8) + bigEndian(1, 8) + "\n";
  const GraphReading binary = readAs(GraphFormat::kVtkPolylines, text);
  EXPECT_EQ(readingRow(binary), "accept 3 2 0 0");
  EXPECT_EQ(binary.cell.parents, (std::vector<std::uint32_t>{kNoParent, 2, 0}));
}

TEST(VtkPolylines, RefusesWhatIsCutShortOrAnotherKind) {
  const std::string whole = kVtk3 + "ASCII\nDATASET POLYDATA\nPOINTS 3 float\n0 0 0 1 0 0 1 1 0\nLINES 1 4\n3 0 1 2\n";
  EXPECT_EQ(vtk(whole), "accept 3 2 0 0");
  for (std::size_t n = 1; n + 2 < whole.size(); ++n) {
    const std::string found = vtk(whole.substr(0, n));
    // A truncation inside a number, or after the last complete one, cannot be detected.
    if (found == "accept 3 2 0 0") continue;
    EXPECT_TRUE(found.starts_with("refuse 0 0") || found == "accept 3 0 0 0") << n << found;
  }
  EXPECT_EQ(vtk(kVtk3 + "ASCII\nDATASET STRUCTURED_POINTS\n"), "refuse 0 0 0 0 E_FORMAT:1");
  EXPECT_EQ(vtk("# not\n"), "refuse 0 0 0 0 E_FORMAT:1");
  EXPECT_EQ(vtk(kVtk3 + "ASCII\nDATASET POLYDATA\nPOINTS 99999999999999 float\n0 0 0"), "refuse 0 0 0 0 E_FORMAT:1");
  EXPECT_EQ(vtk(kVtk3 + "ASCII\nDATASET POLYDATA\nPOINTS 2 float\n0 0 0 1 1 1\nLINES 1 9\n2 0 1\n"),
            "refuse 0 0 0 0 E_FORMAT:1");
  EXPECT_EQ(vtk(kVtk3 + "ASCII\nDATASET POLYDATA\nPOINTS 2 float\n0 0 0 1 1 1\nLINES 1 3\n2 0 5\n"),
            "warn 2 0 0 1 W_MISSING_PARENT:1");
  EXPECT_EQ(vtk(kVtk3 + "ASCII\nDATASET POLYDATA\nPOINTS 3 float\n0 0 0 1 x 1 2 2 nan\nLINES 1 3\n2 0 1\n"),
            "warn 1 0 2 1 W_BAD_LINE:1 W_MISSING_PARENT:1 W_NONFINITE:1");
}

std::string skeleton(const std::vector<std::array<float, 3>>& nodes, const Links& links) {
  std::string bytes = littleEndian(nodes.size(), 4) + littleEndian(links.size(), 4);
  for (const auto& p : nodes)
    for (const float x : p) bytes += littleEndian(bitsOf(x), 4);
  for (const auto& [a, b] : links) bytes += littleEndian(a, 4) + littleEndian(b, 4);
  return bytes;
}

const char* const kInfo =
    R"({"@type": "neuroglancer_skeletons", "transform": [4,0,0,100, 0,4,0,0, 0,0,32,0],
        "vertex_attributes": [{"id": "labels", "data_type": "int16", "num_components": 2},
                              {"id": "radius", "data_type": "float32", "num_components": 1},
                              {"id": "vertex_types", "data_type": "uint8", "num_components": 1}]})";

TEST(NeuroglancerSkeleton, AppliesTheTransformAndReadsAttributes) {
  const GraphOptions options{{.unit_um = 1000}, SkeletonInfo::parse(kInfo, "info")};
  const std::string bytes = skeleton({{0, 0, 0}, {1000, 0, 0}, {0, 0, 100}}, {{0, 1}, {1, 2}, {2, 0}}) +
                            std::string(12, 'x') + littleEndian(bitsOf(31.25), 4) + littleEndian(bitsOf(0), 4) +
                            littleEndian(bitsOf(-5), 4) + "\x01\x03\x02";
  const GraphReading reading = readAs(GraphFormat::kNeuroglancerSkeleton, bytes, options);
  EXPECT_EQ(readingRow(reading), "warn 3 3 0 0 W_ATTRIBUTE:1 W_BAD_RADIUS:1 W_ZERO_RADIUS:1");
  EXPECT_EQ(reading.report.records.front().token, "labels");
  EXPECT_TRUE(reading.cell.positions_um[1].isApprox(Vector3d(4.1, 0, 0)));
  EXPECT_TRUE(reading.cell.positions_um[2].isApprox(Vector3d(0.1, 0, 3.2)));
  EXPECT_EQ(reading.cell.radii_um[0], 0.25f) << "the volume of a unit cube is 8 nm cubed";
  EXPECT_EQ(reading.cell.types, (std::vector<std::uint16_t>{1, 3, 2}));
  for (std::size_t n = 0; n < bytes.size(); ++n)
    EXPECT_EQ(readingRow(readAs(GraphFormat::kNeuroglancerSkeleton, bytes.substr(0, n), options)),
              "refuse 0 0 0 0 E_FORMAT:1")
        << n;
  EXPECT_EQ(readingRow(readAs(GraphFormat::kNeuroglancerSkeleton, bytes + "x", options)), "refuse 0 0 0 0 E_FORMAT:1");
}

TEST(NeuroglancerSkeleton, RadiusHasTheUnitOfTheStoredPositions) {
  const auto radius = [](const std::string& transform) {
    const GraphOptions options{{},
                               SkeletonInfo::parse(R"({"@type": "neuroglancer_skeletons", "transform": )" + transform +
                                                       R"(, "vertex_attributes":
      [{"id": "radius", "data_type": "float32", "num_components": 1}]})",
                                                   "info")};
    const std::string bytes =
        skeleton({{0, 0, 0}, {1, 1, 1}}, {{0, 1}}) + littleEndian(bitsOf(10), 4) + littleEndian(bitsOf(10), 4);
    return readAs(GraphFormat::kNeuroglancerSkeleton, bytes, options).cell.radii_um.at(0);
  };
  EXPECT_EQ(radius("[8,0,0,0, 0,8,0,0, 0,0,8,0]"), 0.08f);
  EXPECT_EQ(radius("[0,8,0,1, -8,0,0,2, 0,0,8,3]"), 0.08f) << "turned";
  EXPECT_EQ(radius("[1,0,0,0, 0,1,0,0, 0,0,1,0]"), 0.01f);
  EXPECT_NEAR(radius("[4,0,0,0, 0,4,0,0, 0,0,40,0]"), 0.01 * std::cbrt(640), 1e-7) << "scales that differ";
  EXPECT_TRUE(std::isnan(radius("[8,0,0,0, 0,8,0,0, 0,0,0,0]"))) << "flat";
  EXPECT_TRUE(std::isnan(radius("[1e200,0,0,0, 0,1e200,0,0, 0,0,1e200,0]")));
}

// As the skeletons of CAVE have them.
TEST(NeuroglancerSkeleton, CompartmentsAreTypes) {
  const auto read = [](const std::string& attributes, const std::string& bytes) {
    return readAs(GraphFormat::kNeuroglancerSkeleton,
                  skeleton({{0, 0, 0}, {1000, 0, 0}, {0, 0, 100}}, {{0, 1}, {1, 2}}) + bytes,
                  {{},
                   SkeletonInfo::parse(
                       R"({"@type": "neuroglancer_skeletons", "vertex_attributes": [)" + attributes + "]}", "info")});
  };
  for (const auto& [type, size] : std::vector<std::pair<std::string, std::size_t>>{
           {"uint8", 1}, {"int8", 1}, {"uint16", 2}, {"int16", 2}, {"uint32", 4}, {"int32", 4}}) {
    std::string bytes;
    for (const std::uint64_t value : {1u, 2u, 3u}) bytes += littleEndian(value, size);
    const GraphReading reading =
        read(R"({"id": "compartment", "data_type": ")" + type + R"(", "num_components": 1})", bytes);
    EXPECT_EQ(readingRow(reading), "accept 3 2 0 0") << type;
    EXPECT_EQ(reading.cell.types, (std::vector<std::uint16_t>{1, 2, 3})) << type;
  }
  const GraphReading both = read(R"({"id": "compartment", "data_type": "uint8", "num_components": 1},
                                    {"id": "vertex_types", "data_type": "uint8", "num_components": 1},
                                    {"id": "area", "data_type": "float32", "num_components": 1})",
                                 "\x09\x09\x09\x01\x02\x04" + std::string(12, '\0'));
  EXPECT_EQ(readingRow(both), "warn 3 2 0 0 W_ATTRIBUTE:2") << "vertex_types are the types";
  EXPECT_EQ(both.cell.types, (std::vector<std::uint16_t>{1, 2, 4}));
}

TEST(NeuroglancerSkeleton, TypesMayBeFloats) {
  const GraphOptions options{{},
                             SkeletonInfo::parse(R"({"@type": "neuroglancer_skeletons", "vertex_attributes":
      [{"id": "vertex_types", "data_type": "float32", "num_components": 1}]})",
                                                 "info")};
  const GraphReading reading =
      readAs(GraphFormat::kNeuroglancerSkeleton,
             skeleton({{0, 0, 0}, {1000, 0, 0}, {0, 0, 100}}, {{0, 1}, {1, 2}}) + littleEndian(bitsOf(3), 4) +
                 littleEndian(bitsOf(2.5), 4) + littleEndian(bitsOf(65535), 4),
             options);
  EXPECT_EQ(readingRow(reading), "warn 3 2 0 0 W_BAD_TYPE:1") << "2.5 is no type";
  EXPECT_EQ(reading.cell.types, (std::vector<std::uint16_t>{3, 0, 65535}));
}

TEST(NeuroglancerSkeleton, DropsBadNodesAndCutsBadLinks) {
  const std::string bytes = skeleton({{0, 0, 0}, {NAN, 0, 0}, {0, 0, 1}, {3e12f, 0, 0}, {1, 1, 1}},
                                     {{0, 1}, {0, 2}, {2, 2}, {7, 0}, {UINT32_MAX, 0}});
  EXPECT_EQ(readingRow(readAs(GraphFormat::kNeuroglancerSkeleton, bytes)),
            "warn 3 1 2 4 W_MISSING_PARENT:3 W_NONFINITE:1 W_RANGE:1 W_SELF_PARENT:1");
  EXPECT_EQ(
      readingRow(readAs(GraphFormat::kNeuroglancerSkeleton, littleEndian(UINT32_MAX, 4) + littleEndian(UINT32_MAX, 4))),
      "refuse 0 0 0 0 E_FORMAT:1");
}

TEST(NeuroglancerSkeleton, RefusesAnInfoThatItCannotFollow) {
  EXPECT_FALSE(SkeletonInfo::isSkeletonInfo("not json"));
  EXPECT_FALSE(SkeletonInfo::isSkeletonInfo(R"({"@type": "neuroglancer_multiscale_volume"})"));
  EXPECT_FALSE(SkeletonInfo::isSkeletonInfo(std::string(100000, '[')));
  EXPECT_TRUE(SkeletonInfo::isSkeletonInfo(kInfo));
  const std::string type = R"({"@type": "neuroglancer_skeletons", )";
  for (const std::string& bad :
       {type + R"("sharding": {"@type": "neuroglancer_uint64_sharded_v1"}})", type + R"("transform": [1, 2]})",
        type + R"("transform": [1,0,0,0,0,1,0,0,0,0,1,"x"]})", type + R"("vertex_attributes": 3})",
        type + R"("vertex_attributes": [{"id": "a", "data_type": "float64", "num_components": 1}]})",
        type + R"("vertex_attributes": [{"id": "a", "data_type": "int8", "num_components": -1}]})"})
    EXPECT_THROW(SkeletonInfo::parse(bad, "info"), InputError) << bad;
  const SkeletonInfo none = SkeletonInfo::parse(
      type + R"("sharding": null, "transform": null, "vertex_attributes": null, "segment_properties": null})", "info");
  EXPECT_EQ(none.transform_nm[0], 1) << "null is no statement";
}

TEST(GraphFile, EndingsNameTheFormat) {
  EXPECT_EQ(graphFormatOf("a/B.OBJ"), GraphFormat::kObjLines);
  EXPECT_EQ(graphFormatOf("x.edges"), GraphFormat::kEdgeList);
  EXPECT_EQ(graphFormatOf("x.vtk"), GraphFormat::kVtkPolylines);
  EXPECT_EQ(graphFormatOf("x.swc"), std::nullopt);
}

TEST(GraphFile, AFileReadsAsItsBytesDo) {
  const test::TempFolder folder;
  test::writeBytes(folder.file("a.edges"), kTriangle);
  Cell cell;
  std::uint64_t told = 0;
  const InputReport report = readGraphFile(folder.file("a.edges"), GraphFormat::kEdgeList, {}, cell,
                                           [&](std::uint64_t bytes) { told += bytes; });
  const GraphReading reading = readAs(GraphFormat::kEdgeList, kTriangle);
  EXPECT_EQ(cell.digest, reading.cell.digest);
  EXPECT_EQ(cell.links, reading.cell.links);
  EXPECT_EQ(report.samples, 3u);
  EXPECT_EQ(told, kTriangle.size());
  EXPECT_THROW(readGraphFile(folder.file("b.edges"), GraphFormat::kEdgeList, {}, cell), IoError);
}

TEST(GraphFile, ComesInBesideSwcAndFoldersOfSkeletons) {
  const test::TempFolder folder;
  test::writeBytes(folder.file("a.edges"), kTriangle);
  test::writeBytes(folder.file("b.swc"), "1 1 0 0 0 5 -1\n2 3 0 6 0 1 1\n");
  test::writeBytes(folder.file("mesh.obj"), "v 0 0 0\nf 1 1 1\n");
  std::filesystem::create_directory(folder.file("skeletons"));
  test::writeBytes(folder.file("skeletons/info"), R"({"@type": "neuroglancer_skeletons"})");
  test::writeBytes(folder.file("skeletons/720575940600000001"), skeleton({{0, 0, 0}, {1000, 0, 0}}, {{0, 1}}));
  test::writeBytes(folder.file("skeletons/12:0"), "not one of them");
  Input input({folder.file("a.edges"), folder.file("b.swc"), folder.file("skeletons")});
  std::vector<std::string> sources, names;
  std::vector<bool> graphs;
  for (Cell cell; input.next(cell);) {
    sources.push_back(cell.source);
    graphs.push_back(cell.isGraph());
    EXPECT_EQ(cell.positions_um.size(), cell.samples());
  }
  EXPECT_EQ(sources, (std::vector<std::string>{"720575940600000001", "a.edges", "b.swc"}));
  EXPECT_EQ(graphs, (std::vector<bool>{false, true, false}));
  EXPECT_EQ(cellNames(sources), (std::vector<std::string>{"720575940600000001", "a", "b"}));
  std::ostringstream table;
  writeCheckTable(table, input.reports());
  EXPECT_NE(table.str().find("a.edges\taccept\t3\t3\t-\t-\n"), std::string::npos) << table.str();
  // Folders still hold only SWC and archives.
  Input whole({folder.path()});
  std::size_t cells = 0;
  for (Cell cell; whole.next(cell);) ++cells;
  EXPECT_EQ(cells, 1u);
}

// For any bytes: no crash, no endless loop, and nothing lost without a record (the reader throws otherwise).
TEST(GraphFile, DamageIsReportedAndNothingElseHappens) {
  const GraphOptions options{{}, SkeletonInfo::parse(kInfo, "info")};
  const std::vector<std::pair<GraphFormat, std::string>> seeds = {
      {GraphFormat::kEdgeList, kTriangle},
      {GraphFormat::kObjLines, "v 0 0 0\nv 1 0 0\nv 1 1 0\nl 1 2 3 1 \\\n-1\nf 1 2 3\n"},
      {GraphFormat::kVtkPolylines, asciiVtk()},
      {GraphFormat::kVtkPolylines, binaryVtk()},
      {GraphFormat::kNeuroglancerSkeleton,
       skeleton({{0, 0, 0}, {1000, 0, 0}, {0, 0, 100}}, {{0, 1}, {1, 2}, {2, 0}}) + std::string(27, '\1')}};
  std::mt19937 random(5);
  for (int round = 0; round < 4000; ++round) {
    const auto& [format, seed] = seeds[static_cast<std::size_t>(round) % seeds.size()];
    std::string bytes = seed;
    for (std::uint32_t k = 0, n = 1 + random() % 5; k < n && !bytes.empty(); ++k) {
      const std::size_t at = random() % bytes.size();
      switch (random() % 5) {
        case 0:
          bytes[at] = static_cast<char>(random());
          break;
        case 1:
          bytes.erase(at, 1 + random() % 9);
          break;
        case 2:
          bytes.insert(at, std::string(1 + random() % 3, "9-\n \0ex"[random() % 7]));
          break;
        case 3:
          bytes.insert(at, bytes.substr(random() % bytes.size(), random() % 30));
          break;
        default:
          bytes.resize(at + 1);
      }
    }
    SCOPED_TRACE(round);
    readingRow(readAs(format, bytes, options));
  }
}

}  // namespace
}  // namespace filiform
