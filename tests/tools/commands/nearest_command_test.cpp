// filiform nearest as a process: each kind of query gives the results of the library.
#include "tests/support/process.h"
#include "tests/support/temp_folder.h"

#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform {
namespace {

using test::Outcome;
using test::runFiliform;

class NearestCommand : public ::testing::Test {
 protected:
  void SetUp() override {
    // Four segments of 10 um along x; sample 5 is its end.
    test::writeBytes(folder_ / "line.swc",
                     "1 3 0 0 0 1 -1\n2 3 10 0 0 1 1\n3 3 20 0 0 1 2\n4 3 30 0 0 1 3\n5 3 40 0 0 1 4\n");
    const Outcome made = runFiliform({"ingest", folder_ / "line.swc", "-o", set_, "--capacity", "2"});
    ASSERT_EQ(made.exit_code, 0) << made.err;
  }
  test::TempFolder folder_;
  std::string set_ = folder_ / "line.fil";
};

TEST_F(NearestCommand, APointIsReadAlikeOnTheLineAndInAFile) {
  test::writeBytes(folder_ / "bom.txt",
                   "\xEF\xBB\xBF"
                   "1 2 3\r\n");
  EXPECT_EQ(runFiliform({"nearest", set_, "--points", folder_ / "bom.txt"}).out,
            runFiliform({"nearest", set_, "1", "2", "3"}).out);
  // The first wrong coordinate is named.
  EXPECT_NE(runFiliform({"nearest", set_, "a", "b", "c"}).err.find("x is 'a'"), std::string::npos);
  test::writeBytes(folder_ / "wrong.txt", "1 2 3\n1 b c\n");
  EXPECT_NE(runFiliform({"nearest", set_, "--points", folder_ / "wrong.txt"}).err.find("wrong.txt:2: y is 'b'"),
            std::string::npos);
}

TEST_F(NearestCommand, ABoxGivesTheSegmentsThatMeetIt) {
  const Outcome box = runFiliform({"nearest", set_, "--box", "12", "-1", "-1", "23", "1", "1", "--json"});
  ASSERT_EQ(box.exit_code, 0) << box.err;
  const auto rows = nlohmann::json::parse(box.out);
  ASSERT_EQ(rows.size(), 2u) << box.out;
  EXPECT_EQ(rows[0].at("sample"), 3);
  EXPECT_EQ(rows[1].at("sample"), 4);
  const Outcome none = runFiliform({"nearest", set_, "--box", "12", "5", "5", "23", "6", "6"});
  EXPECT_EQ(none.exit_code, 0) << none.err;
  EXPECT_EQ(none.out, "query\trank\tdistance\tx\ty\tz\tcell\tsegment\tsample\texact\ttiles_read\ttype\tradius\tt\n");
}

TEST_F(NearestCommand, ARayGivesTheSegmentsAlongIt) {
  const Outcome ray = runFiliform(
      {"nearest", set_, "--ray", "15", "0", "-100", "0", "0", "1", "--k", "5", "--tolerance", "6", "--json"});
  ASSERT_EQ(ray.exit_code, 0) << ray.err;
  const auto rows = nlohmann::json::parse(ray.out);
  ASSERT_EQ(rows.size(), 3u) << ray.out;
  for (const auto& row : rows) {
    EXPECT_DOUBLE_EQ(row.at("along").get<double>(), 100);
    EXPECT_LE(row.at("distance").get<double>(), 6);
  }
  const Outcome table = runFiliform({"nearest", set_, "--ray", "15", "0", "-100", "0", "0", "1"});
  EXPECT_EQ(table.out.substr(0, table.out.find('\n')),
            "query\trank\tdistance\tx\ty\tz\tcell\tsegment\tsample\texact\ttiles_read\talong\ttype\tradius\tt");
}

TEST_F(NearestCommand, RowsHaveTypeRadiusAndPlace) {
  test::writeBytes(folder_ / "thin.swc", "1 1 0 0 0 4 -1\n2 2 10 0 0 2 1\n3 900 20 0 0 NaN 2\n");
  ASSERT_EQ(runFiliform({"ingest", folder_ / "thin.swc", "-o", folder_ / "thin.fil", "--capacity", "2"}).exit_code, 0);
  const auto ends = [&](std::vector<std::string> words) {
    words.insert(words.begin(), {"nearest", folder_ / "thin.fil"});
    const std::string out = runFiliform(words).out, row = out.substr(out.find('\n') + 1);
    std::size_t at = row.size();
    for (int i = 0; i < 3; ++i) at = row.rfind('\t', at - 1);
    return row.substr(at + 1);
  };
  EXPECT_EQ(ends({"7.5", "1", "0"}), "axon\t2.5\t0.25\n");  // t: 0 at the child, 1 at the parent
  EXPECT_EQ(ends({"-5", "0", "0"}), "axon\t4\t1\n");
  EXPECT_EQ(ends({"15", "0", "0"}), "900\t-\t0.5\n");
  EXPECT_EQ(ends({"--ray", "7.5", "0", "-9", "0", "0", "1"}), "axon\t2.5\t0.25\n");
  EXPECT_EQ(ends({"--approximate", "15", "0", "0"}).substr(0, 4), "-\t-\t");
  const auto row =
      nlohmann::json::parse(runFiliform({"nearest", folder_ / "thin.fil", "15", "0", "0", "--json"}).out)[0];
  EXPECT_EQ(row.at("type"), "900");
  EXPECT_TRUE(row.at("radius").is_null());
  EXPECT_EQ(row.at("t"), 0.5);
}

TEST_F(NearestCommand, RowsDependNeitherOnOtherPointsNorOnThreads) {
  std::string points;
  for (int i = 0; i < 400; ++i) points += std::to_string((i * 37) % 41) + " 1 0\n";
  test::writeBytes(folder_ / "points.txt", points);
  const Outcome all = runFiliform({"nearest", set_, "--points", folder_ / "points.txt"});
  ASSERT_EQ(all.exit_code, 0) << all.err;
  for (const char* budget : {"1KiB", "1MiB"}) {
    const Outcome same =
        runFiliform({"nearest", set_, "--points", folder_ / "points.txt", "--threads", "3", "--budget", budget});
    EXPECT_EQ(same.out, all.out) << budget;
  }
  const Outcome one = runFiliform({"nearest", set_, "5", "1", "0"});  // points[9]
  EXPECT_NE(all.out.find("\n9" + one.out.substr(one.out.find('\n') + 2)), std::string::npos) << one.out;
}

TEST_F(NearestCommand, PointsOutsideTheRangeAreNamedByLine) {
  test::writeBytes(folder_ / "points.txt", "1 2 3\n\n1 2 1e200\n");
  const Outcome refused = runFiliform({"nearest", set_, "--points", folder_ / "points.txt"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_NE(refused.err.find("points.txt:3: coordinates must lie within 1e150 um"), std::string::npos) << refused.err;
}

TEST_F(NearestCommand, ARefusedQueryPrintsNoHeader) {
  const std::vector<std::vector<std::string>> wrong{{"--box", "5", "5", "5", "0", "0", "0"},
                                                    {"--ray", "0", "0", "0", "0", "0", "0"},
                                                    {"--box", "0", "0", "0", "5", "5", "x"}};
  for (const std::vector<std::string>& query : wrong) {
    for (const char* form : {"--tsv", "--json"}) {
      std::vector<std::string> words{"nearest", set_, form};
      words.insert(words.end(), query.begin(), query.end());
      const Outcome refused = runFiliform(words);
      EXPECT_EQ(refused.exit_code, 2) << refused.err;
      EXPECT_EQ(refused.out, "") << query.front() << form;
      EXPECT_TRUE(refused.oneLineOnStderr()) << refused.err;
    }
  }
}

TEST_F(NearestCommand, OneKindOfQueryAtATime) {
  const std::vector<std::string> box{"--box", "0", "0", "0", "1", "1", "1"}, ray{"--ray", "0", "0", "0", "0", "0", "1"},
      point{"1", "2", "3"};
  for (const auto& [first, second] : {std::pair(box, ray), std::pair(point, box), std::pair(point, ray)}) {
    std::vector<std::string> words{"nearest", set_};
    words.insert(words.end(), first.begin(), first.end());
    words.insert(words.end(), second.begin(), second.end());
    const Outcome both = runFiliform(words);
    EXPECT_EQ(both.exit_code, 2) << both.out;
    EXPECT_NE(both.err.find("give one of"), std::string::npos) << both.err;
  }
  EXPECT_EQ(runFiliform({"nearest", set_}).exit_code, 2);
}

// Three cells along x, one below the other: their axons are at y = 1, their dendrites at y = 0.
class FilteredNearestCommand : public ::testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::create_directory(folder_ / "in");
    for (int c = 0; c < 3; ++c) {
      const std::string z = std::to_string(10 * c);
      test::writeBytes(
          folder_ / ("in/cell" + std::to_string(c) + ".swc"),
          "1 3 0 0 " + z + " 1 -1\n2 3 40 0 " + z + " 1 1\n3 2 0 1 " + z + " 1 1\n4 2 40 1 " + z + " 1 3\n");
    }
    test::writeBytes(folder_ / "layers.tsv", "name\tlayer\ncell0\t1\ncell1\t5\ncell2\t6\n");
    const Outcome made = runFiliform({"ingest", folder_ / "in", "-o", set_, "--capacity", "2", "--attributes",
                                      folder_ / "layers.tsv", "--key", "name"});
    ASSERT_EQ(made.exit_code, 0) << made.err;
  }
  // The cells and samples of the rows: `cell0:2 cell1:2 `.
  std::string found(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), {"nearest", set_});
    arguments.push_back("--json");
    const Outcome outcome = runFiliform(arguments);
    if (outcome.exit_code != 0) return outcome.err;
    std::string all;
    for (const auto& row : nlohmann::json::parse(outcome.out))
      all += row.at("cell").get<std::string>() + ":" + std::to_string(row.at("sample").get<int>()) + " ";
    return all;
  }
  test::TempFolder folder_;
  std::string set_ = folder_ / "cells.fil";
};

TEST_F(FilteredNearestCommand, EachQueryTakesFilters) {
  EXPECT_EQ(found({"20", "0", "0"}), "cell0:2 ");
  EXPECT_EQ(found({"20", "0", "0", "--type", "axon"}), "cell0:4 ");
  EXPECT_EQ(found({"20", "0", "0", "--cell", "cell2"}), "cell2:2 ");
  EXPECT_EQ(found({"20", "0", "0", "--not-cell", "cell0", "--type", "2"}), "cell1:4 ");
  EXPECT_EQ(found({"20", "0", "0", "--where", "layer>=5", "--where", "layer!=5"}), "cell2:2 ");
  EXPECT_EQ(found({"20", "0", "0", "--cells", "--k", "3"}), "cell0:2 cell1:2 cell2:2 ");
  EXPECT_EQ(found({"20", "0", "0", "--radius", "10", "--type", "axon,soma", "--cells"}), "cell0:4 ");
  EXPECT_EQ(found({"--box", "19", "-1", "-1", "21", "2", "12", "--type", "axon"}), "cell1:4 cell0:4 ");
  EXPECT_EQ(found({"--ray", "20", "0", "-5", "0", "0", "1", "--k", "5", "--cells", "--not-cell", "cell1"}),
            "cell0:2 cell2:2 ");
  test::writeBytes(folder_ / "points.txt", "20 0 0\n20 0 20\n");
  EXPECT_EQ(found({"--points", folder_ / "points.txt", "--own", "no"}), "cell1:2 cell1:2 ");
  EXPECT_EQ(found({"--points", folder_ / "points.txt", "--own", "no", "--cells", "--type", "axon", "--k", "2"}),
            "cell1:4 cell2:4 cell1:4 cell0:4 ");
  EXPECT_EQ(found({"20", "0", "0", "--own", "no", "--where", "layer=1"}), "");
  EXPECT_EQ(found({"--points", folder_ / "points.txt", "--where", "layer<6", "--type", "dendrite"}),
            "cell0:2 cell1:2 ");
}

TEST_F(FilteredNearestCommand, MistakesAreNamedWithNearNames) {
  EXPECT_NE(found({"0", "0", "0", "--cell", "cel1"}).find("did you mean"), std::string::npos);
  EXPECT_NE(found({"0", "0", "0", "--not-cell", "cel1"}).find("--not-cell"), std::string::npos);
  EXPECT_NE(found({"0", "0", "0", "--type", "axn"}).find("did you mean 'axon'"), std::string::npos);
  EXPECT_NE(found({"0", "0", "0", "--where", "depth=1"}).find("layer"), std::string::npos);
  EXPECT_NE(found({"0", "0", "0", "--approximate", "--type", "axon"}).find("--type"), std::string::npos);
  EXPECT_NE(found({"0", "0", "0", "--own", "no", "--approximate"}).find("--own"), std::string::npos);
  for (const char* other : {"--box", "--ray"})
    EXPECT_NE(found({"--own", "no", other, "0", "0", "0", "1", "1", "1"}).find("--own"), std::string::npos) << other;
  const Outcome none = runFiliform({"nearest", set_, "0", "0", "0", "--where", "layer=7"});
  EXPECT_EQ(none.exit_code, 0);
  EXPECT_NE(none.err.find("no cell meets the conditions"), std::string::npos);
}

}  // namespace
}  // namespace filiform
