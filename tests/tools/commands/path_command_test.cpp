// filiform path as a process: known lengths, each form of output, and what a newcomer may do wrong.
#include "tests/support/process.h"
#include "tests/support/temp_folder.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform {
namespace {

using test::Outcome;
using test::runFiliform;

class PathCommand : public ::testing::Test {
 protected:
  void SetUp() override {
    // A trunk of 10 um, a branch of 5 um (3), one of 20 um (4, 5); 9 is isolated. A square of 4 um a side with a stem
    // of
    // 3.
    test::writeBytes(folder_ / "fork.swc",
                     "1 1 0 0 0 5 -1\n2 3 10 0 0 2 1\n3 3 13 4 0 1 2\n4 3 10 -10 0 1 2\n5 4 10 -20 0 0.5 4\n"
                     "9 3 50 50 50 1 -1\n");
    test::writeBytes(folder_ / "square.edges",
                     "node 1 0 0 7\nnode 2 4 0 7\nnode 3 4 4 7\nnode 4 0 4 7\nnode 5 -3 4 7\n"
                     "edge 1 2\nedge 2 3\nedge 3 4\nedge 4 1\nedge 4 5\n");
    const Outcome made =
        runFiliform({"ingest", folder_ / "fork.swc", folder_ / "square.edges", "-o", set_, "--capacity", "2"});
    ASSERT_EQ(made.exit_code, 0) << made.err;
  }
  Outcome path(std::vector<std::string> words) const {
    words.insert(words.begin(), {"path", set_});
    return runFiliform(words);
  }
  double length_um(const std::string& from, const std::string& to) const {
    const Outcome outcome = path({from, to, "--json"});
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_EQ(outcome.err, "");
    return nlohmann::json::parse(outcome.out).at("length_um");
  }
  void expectRefusal(const std::vector<std::string>& words, const std::vector<std::string>& says) const {
    const Outcome outcome = path(words);
    EXPECT_EQ(outcome.exit_code, 2) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    EXPECT_TRUE(outcome.oneLineOnStderr()) << outcome.err;
    for (const std::string& text : says) EXPECT_NE(outcome.err.find(text), std::string::npos) << text << outcome.err;
  }
  test::TempFolder folder_;
  std::string set_ = folder_ / "set.fil";
};

TEST_F(PathCommand, LengthsAreThoseAlongTheCell) {
  EXPECT_EQ(length_um("fork:1", "fork:3"), 15);
  EXPECT_EQ(length_um("fork:3", "fork:5"), 25);
  EXPECT_EQ(length_um("fork:5", "fork:5"), 0);
  EXPECT_EQ(length_um("fork:3+0.5", "fork:4+0.25"), 2.5 + 7.5);
  EXPECT_EQ(length_um("fork:5+0.25", "fork:5+0.75"), 5);
  EXPECT_EQ(length_um("fork:5+1", "fork:4"), 0) << "the parent of 5";
  EXPECT_EQ(length_um("FOR:1", "fork.swc:3"), 15) << "a part of the name, a part of the source";
  EXPECT_EQ(length_um("square:1", "square:3"), 8);
  EXPECT_EQ(length_um("square:5", "square:1"), 7) << "the shorter way round the loop";
}

TEST_F(PathCommand, TextJsonAndTsvAgree) {
  const Outcome text = path({"fork:3+0.5", "fork:5"});
  EXPECT_EQ(text.out, "fork: from sample 3+0.5 to sample 5: 22.50 um along the cell, 22.05 um straight, 4 points\n");
  const Outcome tsv = path({"fork:3+0.5", "fork:5", "--tsv"});
  EXPECT_EQ(tsv.out,
            "sample\tx\ty\tz\talong\n-\t11.5\t2\t0\t0\n2\t10\t0\t0\t2.5\n4\t10\t-10\t0\t12.5\n5\t10\t-20\t0\t22.5\n");
  const auto json = nlohmann::ordered_json::parse(path({"fork:3+0.5", "fork:5", "--json"}).out);
  std::vector<std::string> keys;
  for (const auto& [key, value] : json.items()) keys.push_back(key);
  EXPECT_EQ(keys, (std::vector<std::string>{"cell", "length_um", "straight_um", "from", "to", "points"}));
  EXPECT_EQ(json.at("cell"), "fork");
  EXPECT_EQ(json.at("length_um"), 22.5);
  EXPECT_EQ(json.at("from").dump(), R"({"sample":3,"t":0.5,"x":11.5,"y":2.0,"z":0.0})");
  EXPECT_EQ(json.at("to").dump(), R"({"sample":5,"t":0.0,"x":10.0,"y":-20.0,"z":0.0})");
  ASSERT_EQ(json.at("points").size(), 4u);
  EXPECT_EQ(json.at("points").at(0).dump(), R"({"sample":null,"x":11.5,"y":2.0,"z":0.0,"along":0.0})");
  EXPECT_EQ(json.at("points").at(3).dump(), R"({"sample":5,"x":10.0,"y":-20.0,"z":0.0,"along":22.5})");
}

TEST_F(PathCommand, TheFarthestTipIsAlongTheCell) {
  const Outcome text = path({"fork:1", "--to-farthest-tip"});
  EXPECT_EQ(text.exit_code, 0) << text.err;
  EXPECT_EQ(
      text.out,
      "fork: from sample 1 to the farthest tip, sample 5: 30.00 um along the cell, 22.36 um straight, 4 points\n");
  const auto json = nlohmann::json::parse(path({"fork:5", "--to-farthest-tip", "--json"}).out);
  EXPECT_EQ(json.at("to").at("sample"), 1) << "a root with one neurite is a tip";
  EXPECT_EQ(json.at("length_um"), 30);
  expectRefusal({"fork:9", "--to-farthest-tip"}, {"fork:9", "no tip", "sample 9 of 'fork'"});
}

TEST_F(PathCommand, AsSwcThePathIsItselfACell) {
  const std::string swc = folder_ / "path.swc";
  const Outcome outcome = path({"fork:3+0.5", "fork:5", "-o", swc});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("22.50 um along the cell"), std::string::npos) << outcome.out;
  EXPECT_EQ(test::readBytes(swc),
            "# fork from sample 3+0.5 to sample 5\n# source: fork.swc\n# id type x y z radius parent, um\n"
            "1 3 11.5 2 0 1 -1\n2 3 10 0 0 2 1\n3 3 10 -10 0 1 2\n4 4 10 -20 0 0.5 3\n");
  const Outcome through = path({"fork:3+0.5", "fork:5", "-o", "-"});
  EXPECT_EQ(through.out, test::readBytes(swc));
  EXPECT_NE(through.err.find("22.50 um along the cell"), std::string::npos) << through.err;
  const std::string again = folder_ / "again.fil";
  ASSERT_EQ(runFiliform({"ingest", swc, "-o", again}).exit_code, 0);
  const auto cell = nlohmann::json::parse(runFiliform({"cells", again, "--json"}).out).at(0);
  EXPECT_EQ(cell.at("length_um"), 22.5);
  expectRefusal({"fork:3", "fork:5", "-o", folder_ / "path.obj"}, {"--output", "path.obj", ".swc"});
}

TEST_F(PathCommand, ANewcomerIsToldWhatToWrite) {
  expectRefusal({"frok:1", "fork:2"}, {"FROM frok: no cell", "did you mean 'fork'?"});
  expectRefusal({"fork:1", "sqare:2"}, {"TO sqare: no cell", "did you mean 'square'?"});
  expectRefusal({"fork", "fork:2"}, {"FROM fork: is no place on a cell", "CELL:soma", "CELL:ID", "CELL:X,Y,Z"});
  expectRefusal({"fork:7", "fork:2"}, {"FROM fork:7: 'fork' has no sample 7; the nearest ids are 5 and 9"});
  expectRefusal({"fork:1", "fork:99"}, {"TO fork:99: 'fork' has no sample 99; its highest id is 9"});
  expectRefusal({"fork:1", "fork:-3"}, {"'fork' has no sample -3; its lowest id is 1"});
  expectRefusal({"fork:1", "square:2"}, {"FROM is in 'fork' and TO in 'square'", "one cell"});
  expectRefusal({"fork:1", "fork:9"}, {"samples 1 and 9 of 'fork' are not connected", "2 separate trees"});
  expectRefusal({"fork:1"}, {"second place TO", "--to-farthest-tip"});
  expectRefusal({"fork:1", "fork:2", "--to-farthest-tip"}, {"give one of"});
  expectRefusal({"square:soma", "square:2"}, {"FROM square:soma: 'square' has no soma", "sample 1"});
  expectRefusal({"fork:1,2", "fork:2"}, {"FROM fork:1,2: is no place on a cell"});
  expectRefusal({"fork:1,2,nan", "fork:2"}, {"is no place on a cell"});
}

TEST_F(PathCommand, APlaceBetweenSamplesNeedsOneParent) {
  expectRefusal({"fork:1+0.5", "fork:2"}, {"sample 1 of 'fork' has no parent"});
  expectRefusal({"fork:2+1.5", "fork:2"}, {"FROM fork:2+1.5", "T from 0 (the sample) to 1 (its parent)"});
  expectRefusal({"fork:2+x", "fork:2"}, {"FROM fork:2+x: is no place"});
  expectRefusal({"square:3+0.5", "square:1"}, {"sample 3 of 'square' has 2 parents", "loops"});
  EXPECT_EQ(length_um("square:5+0.5", "square:4"), 1.5);
}

TEST_F(PathCommand, ASomaAndTheSampleNearestToAPointArePlaces) {
  EXPECT_EQ(length_um("fork:soma", "fork:5"), length_um("fork:1", "fork:5"));
  EXPECT_EQ(length_um("fork:Soma", "fork:5"), length_um("fork:1", "fork:5")) << "in any letter case";
  EXPECT_EQ(length_um("fork:1", "fork:11,-19,3"), length_um("fork:1", "fork:5"));
  EXPECT_EQ(length_um("ork:1", "ORK: 11, -19, 3"), length_um("fork:1", "fork:5")) << "a part of a name, blanks";
  EXPECT_EQ(length_um("square:0,0,0", "square:5"), length_um("square:1", "square:5"));
}

TEST_F(PathCommand, OfSeveralSomataTheConnectedOneCounts) {
  test::writeBytes(folder_ / "two.swc",
                   "1 1 0 0 0 1 -1\n2 3 1 0 0 1 1\n3 1 0 50 0 1 -1\n4 3 2 50 0 1 3\n5 3 6 50 0 1 4\n");
  const std::string set = folder_ / "two.fil";
  ASSERT_EQ(runFiliform({"ingest", folder_ / "two.swc", "-o", set, "--one-cell-a-file"}).exit_code, 0);
  const Outcome outcome = runFiliform({"path", set, "two:soma", "two:5", "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(nlohmann::json::parse(outcome.out).at("length_um"), 6);
  EXPECT_NE(outcome.err.find("'two' has several somata"), std::string::npos) << outcome.err;
}

TEST_F(PathCommand, OfRepeatedIdsTheFirstConnectedPairCounts) {
  test::writeBytes(folder_ / "twice.swc",
                   "1 3 0 0 0 1 -1\n2 3 1 0 0 1 1\n1 3 0 50 0 1 -1\n2 3 2 50 0 1 1\n3 3 6 50 0 1 2\n");
  const std::string set = folder_ / "twice.fil";
  ASSERT_EQ(runFiliform({"ingest", folder_ / "twice.swc", "-o", set}).exit_code, 0);
  for (const auto& [to, expected] : std::vector<std::pair<std::string, double>>{{"twice:2", 1}, {"twice:3", 6}}) {
    const Outcome outcome = runFiliform({"path", set, "twice:1", to, "--json"});
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_EQ(nlohmann::json::parse(outcome.out).at("length_um"), expected);
    EXPECT_NE(outcome.err.find("note: sample ids repeat in 'twice'"), std::string::npos) << outcome.err;
    EXPECT_TRUE(outcome.oneLineOnStderr()) << outcome.err;
  }
}

}  // namespace
}  // namespace filiform
