// filiform cells as a process; compares the figures of the list with known cells.
#include "tests/support/process.h"
#include "tests/support/temp_folder.h"

#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform {
namespace {

using test::Outcome;
using test::runFiliform;

std::vector<std::string> fieldsOf(const std::string& text, char separator) {
  std::vector<std::string> fields;
  std::istringstream in(text);
  for (std::string field; std::getline(in, field, separator);) fields.push_back(field);
  return fields;
}

class CellsCommand : public ::testing::Test {
 protected:
  void SetUp() override {
    // 10 + 5 um and an isolated sample; a square of 4 um a side with a stem of 3; two more that --name leaves out.
    test::writeBytes(folder_ / "bent.swc", "1 1 0 0 0 5 -1\n2 3 10 0 0 1 1\n3 3 13 4 0 1 2\n9 3 50 50 50 1 -1\n");
    test::writeBytes(folder_ / "square.edges",
                     "node 1 0 0 7\nnode 2 4 0 7\nnode 3 4 4 7\nnode 4 0 4 7\nnode 5 -3 4 7\n"
                     "edge 1 2\nedge 2 3\nedge 3 4\nedge 4 1\nedge 4 5\n");
    test::writeBytes(folder_ / "x1.swc", "1 1 0 0 0 5 -1\n2 3 1 0 0 1 1\n");
    test::writeBytes(folder_ / "x\tb.swc", "1 1 0 0 0 5 -1\n2 3 0 2 0 1 1\n");
    const Outcome made = runFiliform({"ingest", folder_ / "bent.swc", folder_ / "square.edges", folder_ / "x1.swc",
                                      folder_ / "x\tb.swc", "-o", set_, "--capacity", "2"});
    ASSERT_EQ(made.exit_code, 0) << made.err;
  }
  test::TempFolder folder_;
  std::string set_ = folder_ / "set.fil";
};

TEST_F(CellsCommand, JsonHoldsWhatEachCellIs) {
  const Outcome outcome = runFiliform({"cells", set_, "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  const auto cells = nlohmann::ordered_json::parse(outcome.out);
  ASSERT_EQ(cells.size(), 4u);
  std::vector<std::string> keys;
  for (const auto& [key, value] : cells[0].items()) keys.push_back(key);
  EXPECT_EQ(keys, (std::vector<std::string>{"id", "name", "source", "samples", "segments", "isolated", "roots", "loops",
                                            "length_um", "box_um"}));
  EXPECT_EQ(cells[0].at("id"), 0);
  EXPECT_EQ(cells[0].at("name"), "bent");
  EXPECT_EQ(cells[0].at("source"), "bent.swc");
  EXPECT_EQ(cells[0].at("samples"), 4);
  EXPECT_EQ(cells[0].at("segments"), 2);
  EXPECT_EQ(cells[0].at("isolated"), 1);
  EXPECT_EQ(cells[0].at("roots"), 2);
  EXPECT_EQ(cells[0].at("loops"), 0);
  EXPECT_DOUBLE_EQ(cells[0].at("length_um").get<double>(), 15);
  EXPECT_EQ(cells[0].at("box_um"), nlohmann::json::parse("[[0.0, 0.0, 0.0], [50.0, 50.0, 50.0]]"));
  EXPECT_EQ(cells[1].at("name"), "square");
  EXPECT_EQ(cells[1].at("loops"), 1);
  EXPECT_DOUBLE_EQ(cells[1].at("length_um").get<double>(), 19);
}

TEST_F(CellsCommand, LengthLeavesOutTheLinksInsideASoma) {
  const std::string three = folder_ / "three.fil";
  test::writeBytes(folder_ / "three.swc", "1 1 0 0 0 5 -1\n2 1 0 -5 0 5 1\n3 1 0 5 0 5 1\n4 3 0 0 20 1 1\n");
  ASSERT_EQ(runFiliform({"ingest", folder_ / "three.swc", "-o", three}).exit_code, 0);
  const Outcome outcome = runFiliform({"cells", three, "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto cell = nlohmann::json::parse(outcome.out).at(0);
  EXPECT_EQ(cell.at("segments"), 3);
  EXPECT_DOUBLE_EQ(cell.at("length_um").get<double>(), 20);
}

TEST_F(CellsCommand, TsvHasTheSameFigures) {
  const Outcome outcome = runFiliform({"cells", set_, "--tsv"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::vector<std::string> lines = fieldsOf(outcome.out, '\n');
  ASSERT_EQ(lines.size(), 5u) << outcome.out;
  EXPECT_EQ(lines[0], "id\tname\tsource\tsamples\tsegments\tisolated\troots\tloops\tlength_um\tx0\ty0\tz0\tx1\ty1\tz1");
  EXPECT_EQ(lines[1], "0\tbent\tbent.swc\t4\t2\t1\t2\t0\t15\t0\t0\t0\t50\t50\t50");
  EXPECT_EQ(lines[2], "1\tsquare\tsquare.edges\t5\t5\t0\t1\t1\t19\t-3\t0\t7\t4\t4\t7");
  for (const std::string& line : lines) EXPECT_EQ(fieldsOf(line, '\t').size(), 15u) << line;
}

TEST_F(CellsCommand, TextIsATable) {
  const Outcome outcome = runFiliform({"cells", set_});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::vector<std::string> lines = fieldsOf(outcome.out, '\n');
  ASSERT_EQ(lines.size(), 5u) << outcome.out;
  // Columns are aligned with their titles: numbers end where the title ends, names begin where it begins.
  EXPECT_EQ(lines[1].find("bent"), lines[0].find("name"));
  EXPECT_EQ(lines[1].find("bent.swc"), lines[0].find("source"));
  EXPECT_EQ(lines[2].find("19.0") + 4, lines[0].find("length, um") + 10);
  EXPECT_NE(lines[2].find("-3.0 to 4.0"), std::string::npos) << outcome.out;
}

TEST_F(CellsCommand, ANameIsAGlob) {
  const auto ids = [&](const std::string& glob) {
    const Outcome outcome = runFiliform({"cells", set_, "--name", glob, "--json"});
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    std::vector<int> found;
    for (const auto& cell : nlohmann::json::parse(outcome.out)) {
      found.push_back(cell.at("id"));
      EXPECT_TRUE(cell.at("length_um").is_number()) << outcome.out;
    }
    return found;
  };
  EXPECT_EQ(ids("*"), (std::vector<int>{0, 1, 2, 3}));
  EXPECT_EQ(ids("x*"), (std::vector<int>{2, 3}));
  EXPECT_EQ(ids("x?"), (std::vector<int>{3}));
  EXPECT_EQ(ids("[bs]*"), (std::vector<int>{0, 1}));
  EXPECT_EQ(ids("ben"), (std::vector<int>{}));
  const Outcome none = runFiliform({"cells", set_, "--name", "nobody", "--json"});
  EXPECT_EQ(none.out, "[]\n");
  EXPECT_TRUE(none.oneLineOnStderr()) << none.err;
  EXPECT_EQ(runFiliform({"cells", set_, "--tsv", "--json"}).exit_code, 2);
}

// The length of a single cell is read from its own tiles, and equals the length in the whole list.
TEST_F(CellsCommand, TheLengthOfOneCellIsThatInTheWholeList) {
  const Outcome whole = runFiliform({"cells", set_, "--tsv"});
  const Outcome one = runFiliform({"cells", set_, "--tsv", "--name", "square"});
  EXPECT_NE(whole.out.find(fieldsOf(one.out, '\n').at(1)), std::string::npos) << one.out << whole.out;
}

// Lengths are read from tiles: for a large set only with --length.
TEST_F(CellsCommand, ManyTilesAreReadOnlyIfAskedFor) {
  std::string line = "1 3 0 0 0 1 -1\n";
  for (int i = 2; i <= 6001; ++i)
    line += std::to_string(i) + " 3 " + std::to_string(i - 1) + " 0 0 1 " + std::to_string(i - 1) + "\n";
  test::writeBytes(folder_ / "long.swc", line);
  const std::string set = folder_ / "long.fil";
  const Outcome made =
      runFiliform({"ingest", folder_ / "long.swc", folder_ / "bent.swc", "-o", set, "--capacity", "1"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const Outcome list = runFiliform({"cells", set, "--json"});
  EXPECT_EQ(list.exit_code, 0);
  EXPECT_TRUE(list.oneLineOnStderr()) << list.err;
  EXPECT_NE(list.err.find("--length"), std::string::npos) << list.err;
  EXPECT_TRUE(nlohmann::json::parse(list.out).at(1).at("length_um").is_null()) << list.out;
  const Outcome measured = runFiliform({"cells", set, "--json", "--length"});
  EXPECT_EQ(measured.err, "");
  EXPECT_DOUBLE_EQ(nlohmann::json::parse(measured.out).at(1).at("length_um").get<double>(), 6000);
  const Outcome one = runFiliform({"cells", set, "--json", "--name", "bent"});
  EXPECT_EQ(one.err, "") << "few tiles";
  EXPECT_DOUBLE_EQ(nlohmann::json::parse(one.out).at(0).at("length_um").get<double>(), 15);
}

// The JSON of `info` has everything that its text has.
TEST_F(CellsCommand, InfoSaysAsMuchInJsonAsInText) {
  test::writeBytes(folder_ / "bad.swc", "nothing\n");
  const std::string set = folder_ / "levels.fil";
  const Outcome made = runFiliform({"ingest", folder_ / "bent.swc", folder_ / "bad.swc", "-o", set, "--capacity", "1"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const Outcome text = runFiliform({"info", set});
  const auto json = nlohmann::json::parse(runFiliform({"info", set, "--json"}).out);
  EXPECT_NE(text.out.find(json.at("revision").get<std::string>()), std::string::npos) << text.out;
  EXPECT_EQ(json.at("box_um"), nlohmann::json::parse("[[0.0, 0.0, 0.0], [50.0, 50.0, 50.0]]"));
  EXPECT_EQ(json.at("ghosts").get<int>(),
            json.at("stored_segments").get<int>() - json.at("segments").get<int>() - json.at("isolated").get<int>());
  EXPECT_GT(json.at("smallest_budget_bytes"), 0);
  ASSERT_EQ(json.at("refused_inputs").size(), 1u);
  EXPECT_EQ(json.at("refused_inputs").at(0).at("name"), "bad.swc");
  EXPECT_NE(text.out.find("bad.swc: " + json.at("refused_inputs").at(0).at("reason").get<std::string>()),
            std::string::npos);
  if (json.at("level_tiles") > 0) {
    EXPECT_GT(json.at("level_segments"), 0);
    for (const char* key : {"segments", "error_um", "hidden", "of"})
      EXPECT_TRUE(json.at("coarsest_level").contains(key)) << key;
  }
}

TEST_F(CellsCommand, SortAndConditionsOnMeasures) {
  const auto names = [&](std::vector<std::string> words) {
    words.insert(words.begin(), {"cells", set_, "--json"});
    const Outcome outcome = runFiliform(words);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    std::vector<std::string> found;
    for (const auto& cell : nlohmann::json::parse(outcome.out)) found.push_back(cell.at("name"));
    return found;
  };
  // Without soma links: bent 5 um, the square 19 um, the others 0.
  EXPECT_EQ(names({"--sort", "measure:length", "--reverse"}).at(0), "square");
  EXPECT_EQ(names({"--sort", "samples"}).at(3), "square");
  EXPECT_EQ(names({"--sort", "name", "--reverse"}), names({"--sort", "id", "--reverse"}));
  EXPECT_EQ(names({"--where", "measure:length>5"}), std::vector<std::string>{"square"});
  EXPECT_EQ(names({"--where", "measure:length>=5", "--where", "measure:loops=0"}), std::vector<std::string>{"bent"});
  EXPECT_EQ(names({"--where", "measure:width="}).size(), 0u);
  for (const auto& [words, part] : std::vector<std::pair<std::vector<std::string>, std::string>>{
           {{"--where", "measure:lenght>5"}, "did you mean 'length'"},
           {{"--sort", "sampels"}, "did you mean 'samples'"}}) {
    const Outcome outcome = runFiliform({"cells", set_, words[0], words[1]});
    EXPECT_EQ(outcome.exit_code, 2);
    EXPECT_TRUE(outcome.oneLineOnStderr()) << outcome.err;
    EXPECT_NE(outcome.err.find(part), std::string::npos) << outcome.err;
  }
}

}  // namespace
}  // namespace filiform
