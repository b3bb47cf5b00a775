// filiform measure as a process; compares its figures with known cells.
#include "tests/support/process.h"
#include "tests/support/temp_folder.h"
#include "tests/support/zip_entries.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform {
namespace {

using test::Outcome;
using test::runFiliform;

class MeasureCommand : public ::testing::Test {
 protected:
  void SetUp() override {
    // An axon of 10 um with a fork into 3 and 4 um; a dendrite of 5 um; soma links of 2 and 1 um.
    test::writeBytes(folder_ / "fork.swc",
                     "1 1 0 0 0 1 -1\n2 2 2 0 0 1 1\n3 2 12 0 0 1 2\n4 2 12 3 0 1 3\n5 2 12 -4 0 1 3\n"
                     "10 3 -1 0 0 1 1\n11 3 -6 0 0 1 10\n");
    test::writeBytes(folder_ / "line.swc", "1 1 0 0 0 5 -1\n2 3 7 0 0 1 1\n3 3 7 8 0 1 2\n");
    test::writeBytes(folder_ / "types.csv", "cell,kind\nfork,A\nline,B\n");
    const Outcome made = runFiliform({"ingest", folder_ / "fork.swc", folder_ / "line.swc", "-o", set_, "--attributes",
                                      folder_ / "types.csv", "--key", "cell", "--capacity", "2"});
    ASSERT_EQ(made.exit_code, 0) << made.err;
  }
  nlohmann::json rowsOf(std::vector<std::string> words) {
    words.insert(words.begin(), {"measure", set_, "--json"});
    const Outcome outcome = runFiliform(words);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_EQ(outcome.err, "");
    return nlohmann::json::parse(outcome.out);
  }
  test::TempFolder folder_;
  std::string set_ = folder_ / "set.fil";
};

TEST_F(MeasureCommand, TsvHasARowForEachCell) {
  const Outcome outcome = runFiliform({"measure", set_, "--tsv", "--features", "length,tips,local_angle_mean"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.out,
            "id\tname\tlength_um\ttips\tlocal_angle_mean_rad\n0\tfork\t22\t3\t3.141592653589793\n1\tline\t8\t1\t-\n");
}

TEST_F(MeasureCommand, RowsForTypesNeuritesBranchesAndTheSet) {
  const auto types = rowsOf({"fork", "--per", "type", "--features", "length"});
  ASSERT_EQ(types.size(), 2u);
  EXPECT_EQ(types[0], nlohmann::json::parse(R"({"id": 0, "name": "fork", "type": "axon", "length_um": 17.0})"));
  const auto neurites = rowsOf({"--per", "neurite", "--type", "basal", "--features", "length"});
  ASSERT_EQ(neurites.size(), 2u);
  EXPECT_EQ(neurites[0],
            nlohmann::json::parse(
                R"({"id": 0, "name": "fork", "neurite": 1, "sample": 10, "type": "basal", "length_um": 5.0})"));
  const auto branches = rowsOf({"FORK", "--per", "branch", "--type", "axon", "--features", "length"});
  ASSERT_EQ(branches.size(), 3u);
  EXPECT_EQ(branches[0].at("parent"), -1);
  EXPECT_EQ(branches[2].at("parent"), 0);
  EXPECT_EQ(branches[2].at("sample"), 5);
  EXPECT_EQ(branches[2].at("length_um"), 4);
  const auto set = rowsOf({"--per", "set", "--features", "length,tip_path_max,soma_radius", "--sholl", "2"});
  ASSERT_EQ(set.size(), 1u);
  EXPECT_EQ(set[0].at("cells"), 2);
  EXPECT_EQ(set[0].at("length_um"), 30);
  EXPECT_EQ(set[0].at("soma_radius_um"), nullptr);
  // At 3 um of the fork, and at 7 um of the line, where a neurite begins.
  EXPECT_EQ(set[0].at("sholl").at(1), 2);
  EXPECT_EQ(set[0].at("sholl_by_ends").at(1), 3);
}

TEST_F(MeasureCommand, AllFeaturesWithAnyThreadsGiveTheSameBytes) {
  const auto with = [&](const char* threads) {
    return runFiliform({"measure", set_, "--features", "all", "--tsv", "--sholl", "1.5", "--threads", threads}).out;
  };
  EXPECT_EQ(with("1"), with("2"));
  EXPECT_EQ(with("1"), with("3"));
  EXPECT_EQ(runFiliform({"measure", set_, "--features", "all", "--tsv", "--sholl", "1.5", "--memory", "1"}).out,
            with("1"));
  EXPECT_NE(with("1").find("soma_radius_um"), std::string::npos);
}

TEST_F(MeasureCommand, ConditionsChooseCells) {
  EXPECT_EQ(rowsOf({"--where", "kind=B"}).at(0).at("name"), "line");
  const Outcome none = runFiliform({"measure", set_, "--where", "kind=C", "--json"});
  EXPECT_EQ(none.exit_code, 0);
  EXPECT_EQ(none.out, "[]\n");
  EXPECT_NE(none.err.find("the set has 2 cells"), std::string::npos) << none.err;
}

TEST_F(MeasureCommand, ArraysOfNumpy) {
  const std::string out = folder_ / "m.npz";
  const Outcome outcome = runFiliform({"measure", set_, "--npz", out, "--features", "length,tips", "--sholl", "2"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("2 rows of 6 arrays"), std::string::npos) << outcome.out;
  const std::map<std::string, std::string> arrays = test::entriesOf(out);
  for (const auto& [name, part] :
       std::map<std::string, std::string>{{"length_um.npy", "'<f8', 'fortran_order': False, 'shape': (2,)"},
                                          {"name.npy", "'<U4'"},
                                          {"sholl.npy", "(2,7)"}})
    EXPECT_NE(arrays.at(name).find(part), std::string::npos) << name;
}

TEST_F(MeasureCommand, DensityOnAGrid) {
  const double length_um = rowsOf({"--per", "set", "--features", "length"}).at(0).at("length_um");
  const nlohmann::json boxes = rowsOf({"--density", "4"});
  double sum_um = 0;
  for (const nlohmann::json& box : boxes) {
    sum_um += box.at("length_um").get<double>();
    EXPECT_DOUBLE_EQ(box.at("density_um_per_um3").get<double>() * 64, box.at("length_um").get<double>());
    EXPECT_EQ(std::fmod(box.at("x_um").get<double>(), 4), 0);
  }
  EXPECT_NEAR(sum_um, length_um, 1e-9 * length_um);
  const std::string tsv = runFiliform({"measure", set_, "--density", "4"}).out;
  EXPECT_EQ(tsv.substr(0, tsv.find('\n')), "x_um\ty_um\tz_um\tlength_um\tdensity_um_per_um3");
  EXPECT_EQ(static_cast<std::size_t>(std::count(tsv.begin(), tsv.end(), '\n')), boxes.size() + 1);
  EXPECT_EQ(runFiliform({"measure", set_, "--density", "4", "--threads", "3"}).out, tsv);
  const std::string out = folder_ / "d.npz";
  ASSERT_EQ(runFiliform({"measure", set_, "--density", "4", "--npz", out}).exit_code, 0);
  const std::map<std::string, std::string> arrays = test::entriesOf(out);
  EXPECT_NE(arrays.at("density.npy").find("'<f8'"), std::string::npos);
  EXPECT_NE(arrays.at("origin.npy").find("(3,)"), std::string::npos);
  EXPECT_NE(arrays.at("step.npy").find("(1,)"), std::string::npos);
  EXPECT_TRUE(rowsOf({"--density", "4", "--type", "77"}).empty());
  EXPECT_LT(rowsOf({"--density", "4", "--where", "kind=B"}).size(), boxes.size());
  EXPECT_EQ(runFiliform({"measure", set_, "--density", "4", "--where", "kind=C", "--json"}).out, "[]\n");
}

TEST_F(MeasureCommand, MistakesAreOneLineWithNearNames) {
  const auto expectLine = [&](std::vector<std::string> words, const std::string& part) {
    words.insert(words.begin(), {"measure", set_});
    const Outcome outcome = runFiliform(words);
    EXPECT_EQ(outcome.exit_code, 2) << outcome.err;
    EXPECT_TRUE(outcome.oneLineOnStderr()) << outcome.err;
    EXPECT_NE(outcome.err.find(part), std::string::npos) << outcome.err;
  };
  expectLine({"--features", "lenght"}, "did you mean 'length'");
  expectLine({"--type", "axno"}, "did you mean 'axon'");
  expectLine({"--type", "soma"}, "a soma is no neurite");
  expectLine({"--per", "nuerite"}, "did you mean 'neurite'");
  expectLine({"--where", "knid=A"}, "kind");
  expectLine({"--sholl", "0"}, "above 0");
  expectLine({"--sholl", "nan"}, "--sholl");
  expectLine({"--sholl", "1e-9"}, "larger step");
  expectLine({"--sholl", "10", "--per", "branch"}, "leave one of them out");
  expectLine({"--density", "0"}, "above 0");
  expectLine({"--density", "1e-6"}, "boxes");
  expectLine({"unknown_cell"}, "unknown_cell");
}

}  // namespace
}  // namespace filiform
