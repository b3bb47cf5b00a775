#include "index/formats/internal/mouselight.h"

#include "index/formats/internal/graph_file.h"
#include "index/input/input.h"
#include "tests/support/corpus.h"
#include "tests/support/graph_reading.h"
#include "tests/support/temp_folder.h"

#include <sstream>
#include <string>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::GraphReading;

std::string sampleText(int number, int type, double x, double y, double z, int parent, const std::string& more = "") {
  std::ostringstream out;
  out << R"({"sampleNumber": )" << number << R"(, "structureIdentifier": )" << type << R"(, "x": )" << x << R"(, "y": )"
      << y << R"(, "z": )" << z << R"(, "radius": 0.5, "parentNumber": )" << parent << more << "}";
  return out.str();
}

// A neuron with an axon of three samples and a dendrite of two, which share the soma.
std::string neuronText(const std::string& id) {
  return R"({"idString": ")" + id + R"(", "soma": {"x": 1, "y": 2, "z": 3, "allenId": 382},
 "axon": [)" +
         sampleText(1, 1, 1, 2, 3, -1) + ",\n" + sampleText(2, 2, 4, 2, 3, 1, R"(, "allenId": 7)") + ",\n" +
         sampleText(3, 2, 8, 2, 3, 2) + "],\n \"dendrite\": [" + sampleText(1, 1, 1, 2, 3, -1) + ",\n" +
         sampleText(2, 3, 1, 5, 3, 1) + "]}";
}

GraphReading readNeuron(const std::string& text) { return test::readAs(GraphFormat::kMouseLight, text); }
std::string neuronRow(const std::string& text) { return test::readingRow(readNeuron(text)); }

TEST(MouseLight, AxonAndDendriteShareTheSoma) {
  const GraphReading reading = readNeuron(neuronText("AA0001"));
  const Cell& cell = reading.cell;
  EXPECT_EQ(reading.report.severity, Severity::kAccept);
  EXPECT_EQ(cell.sample_ids, (std::vector<std::int64_t>{1, 2, 3, 5}));
  EXPECT_EQ(cell.parents, (std::vector<std::uint32_t>{kNoParent, 0, 1, 0}));
  EXPECT_EQ(cell.types, (std::vector<std::uint16_t>{1, 2, 2, 3}));
  EXPECT_EQ(cell.positions_um[3], Vector3d(1, 5, 3));
  EXPECT_FLOAT_EQ(cell.radii_um[1], 0.5f);
  EXPECT_EQ(reading.report.roots, 1u);
}

TEST(MouseLight, SomataAtTwoPlacesAreTwoRoots) {
  EXPECT_EQ(neuronRow(R"({"axon": [)" + sampleText(1, 1, 0, 0, 0, -1) + R"(], "dendrite": [)" +
                      sampleText(1, 1, 9, 0, 0, -1) + "," + sampleText(2, 3, 9, 1, 0, 1) + "]}"),
            "accept 3 1 0 0");
}

TEST(MouseLight, ASomaAloneIsASample) {
  EXPECT_EQ(neuronRow(R"({"soma": {"x": 1, "y": 2, "z": 3}, "axon": [], "dendrite": []})"), "accept 1 0 0 0");
  EXPECT_EQ(neuronRow(R"({"axon": []})"), "refuse 0 0 0 0 E_NO_SAMPLES:1");
}

TEST(MouseLight, BadFieldsAreDroppedOrDegradedWithARecord) {
  const std::string good =
      sampleText(1, 1, 0, 0, 0, -1) + "," + sampleText(2, 2, 1, 0, 0, 1) + "," + sampleText(3, 2, 2, 0, 0, 2) + ",";
  const auto row = [&](const std::string& more) { return neuronRow(R"({"axon": [)" + good + more + "]}"); };
  EXPECT_EQ(row(R"({"sampleNumber": 4, "x": null, "y": 0, "z": 0, "parentNumber": 3})"), "warn 3 2 1 0 W_BAD_LINE:1");
  EXPECT_EQ(row(R"({"x": 1, "y": 0, "z": 0, "parentNumber": 3})"), "warn 3 2 1 0 W_SHORT_LINE:1");
  EXPECT_EQ(row(R"({"sampleNumber": 1.5, "x": 1, "y": 0, "z": 0, "parentNumber": 3})"), "warn 3 2 1 0 W_BAD_ID:1");
  EXPECT_EQ(row(R"({"sampleNumber": 4, "x": 1, "y": 0, "z": 0, "parentNumber": "3"})"), "warn 4 2 0 1 W_BAD_PARENT:1");
  EXPECT_EQ(
      row(R"({"sampleNumber": 4, "x": 1, "y": 0, "z": 0, "radius": -1, "structureIdentifier": -2, "parentNumber": 9})"),
      "warn 4 2 0 1 W_BAD_RADIUS:1 W_BAD_TYPE:1 W_MISSING_PARENT:1");
  EXPECT_EQ(row(R"({"sampleNumber": 4, "x": 1, "y": 0, "z": 2e9, "parentNumber": 3})"), "warn 3 2 1 0 W_RANGE:1");
  EXPECT_EQ(row(sampleText(3, 2, 3, 0, 0, 2)), "warn 3 2 1 0 W_DUP_ID:1");
}

TEST(MouseLight, BrokenTextIsRefusedWithItsLine) {
  const GraphReading reading = readNeuron("{\"axon\": [\n{\"sampleNumber\": 1,,}]}");
  EXPECT_EQ(refusalReason(reading.report), "line 2: invalid JSON, byte 31 of neuron");
  EXPECT_EQ(neuronRow(std::string(1000000, '[')), "refuse 0 0 0 0 E_FORMAT:1");
  EXPECT_EQ(neuronRow("[]"), "refuse 0 0 0 0 E_FORMAT:1");
}

std::vector<std::string> sourcesIn(const std::string& text, InputReport* report = nullptr) {
  const test::TempFolder folder;
  test::writeBytes(folder.file("a.json"), text);
  Input input({folder.file("a.json")});
  std::vector<std::string> sources;
  for (Cell cell; input.next(cell);) sources.push_back(cell.source);
  if (report != nullptr) *report = input.reports().at(0).report;
  return sources;
}

TEST(MouseLightFile, HoldsSeveralNeurons) {
  const std::string comment = R"({"comment": "a \"neurons\": [ in a text", "list": [1, {"neurons": []}], "neurons": [)";
  InputReport report;
  EXPECT_EQ(sourcesIn(comment + neuronText("AA1") + ",\n" + neuronText("b/2") + "," + neuronText("") + "]}\n", &report),
            (std::vector<std::string>{"a.json/AA1", "a.json/b_2", "a.json/neuron 3"}));
  EXPECT_EQ(report.samples, 12u);
  EXPECT_EQ(report.segments, 9u);
  EXPECT_EQ(sourcesIn(neuronText("one")), (std::vector<std::string>{"a.json/one"}));
  EXPECT_EQ(sourcesIn("\xEF\xBB\xBF[" + neuronText("x") + "]"), (std::vector<std::string>{"a.json/x"}));
}

TEST(MouseLightFile, OtherJsonIsRefusedWithTheReason) {
  const auto reason = [](const std::string& text) {
    InputReport report;
    EXPECT_TRUE(sourcesIn(text, &report).empty());
    EXPECT_EQ(report.severity, Severity::kRefuse);
    return refusalReason(report);
  };
  EXPECT_EQ(reason(R"({"networks": {}})"),
            "line 1: not MouseLight JSON: it has no list `neurons`, `axon` or `dendrite`");
  EXPECT_EQ(reason("1 1 0 0 0 5 -1\n"), "line 1: not JSON: must begin with '{'");
  EXPECT_EQ(reason("{\"neurons\": [\n" + neuronText("a").substr(0, 200)).substr(0, 20), "line 4: ends inside ");
  EXPECT_EQ(reason("{\"neurons\": []}"), "holds no neuron that may be read");
  EXPECT_EQ(reason("{\"neurons\": [1]}"), "line 1: not MouseLight JSON: a neuron must be an object");
  EXPECT_EQ(reason(""), "line 1: holds nothing");
}

TEST(MouseLightFile, FoldersGiveTheirNeuronsAndNoOtherJson) {
  const test::TempFolder folder;
  test::writeBytes(folder.file("a.json"), "{\"neurons\": [" + neuronText("AA1") + "]}");
  test::writeBytes(folder.file("package.json"), R"({"name": "no neuron"})");
  Input input({folder.path()});
  std::vector<std::string> sources;
  for (Cell cell; input.next(cell);) sources.push_back(cell.source);
  EXPECT_EQ(sources, (std::vector<std::string>{"a.json/AA1"}));
  EXPECT_EQ(cellNames(sources), (std::vector<std::string>{"AA1"}));
  EXPECT_EQ(totals(input.reports()).inputs(), 1u);
}

TEST(MouseLightFile, TheApiWrapsNeuronsInContents) {
  EXPECT_EQ(sourcesIn("{\"contents\": {\"comment\": [1, {}], \"neurons\": [" + neuronText("AA7") + "]}}"),
            (std::vector<std::string>{"a.json/AA7"}));
}

// Two neurons of the whole mouse brain; figures by an independent reading (Python's json).
TEST(MouseLightFile, ReadsWhatTheProjectPublished) {
  if (!test::corpusFolder()) GTEST_SKIP() << "FILIFORM_CORPUS is not set";
  const auto folder = *test::corpusFolder() / "circuits" / "mouselight-showcase";
  Input input({(folder / "AA1506.json").string(), (folder / "AA0052.json").string()});
  std::vector<std::uint64_t> samples;
  for (Cell cell; input.next(cell);) {
    samples.push_back(cell.samples());
    EXPECT_FALSE(cell.isGraph());
    EXPECT_EQ(std::count(cell.parents.begin(), cell.parents.end(), kNoParent), 1);
  }
  EXPECT_EQ(samples, (std::vector<std::uint64_t>{3277 + 808 - 1, 1978 + 1296 - 1}));
  EXPECT_EQ(verdict(input.reports()), Severity::kAccept);
}

}  // namespace
}  // namespace filiform
