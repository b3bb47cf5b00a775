// `filiform compare`: rows of two sets and of two traces, and mistakes.
#include "tests/support/run_here.h"
#include "tests/support/temp_folder.h"
#include "tests/support/what_of.h"

#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform {
namespace {

using test::Outcome;
using test::runHere;

class CompareCommand : public ::testing::Test {
 protected:
  void SetUp() override {
    write("old/same.swc", "1 1 0 0 0 5 -1\n2 3 10 0 0 1 1\n");
    write("new/same.swc", "# the same cell, in another order\n7 3 10 0 0 1 -1\n9 1 0 0 0 5 7\n");
    write("old/moved.swc", "1 1 0 0 0 5 -1\n2 3 10 0 0 1 1\n");
    write("new/moved.swc", "1 1 0 3 4 5 -1\n2 3 10 3 4 1 1\n");
    write("old/changed.swc", "1 1 0 0 0 5 -1\n2 3 10 0 0 1 1\n3 3 20 0 0 1 2\n");
    write("new/changed.swc", "1 1 0 0 0 5 -1\n2 3 10 0 0 2 1\n4 3 20 5 0 1 2\n5 3 30 5 0 1 4\n");
    write("old/removed.swc", "1 3 0 0 0 5 -1\n2 3 1 0 0 1 1\n");
    write("new/added.swc", "1 3 0 0 0 5 -1\n2 3 0 2 0 1 1\n3 3 0 4 0 1 2\n");
    for (const char* const name : {"old", "new"})
      ASSERT_EQ(runHere({"ingest", folder_ / name, "-o", set(name)}).exit_code, 0);
  }
  std::string set(const std::string& name) const { return folder_ / (name + ".fil"); }
  void write(const std::string& name, const std::string& text) const { test::writeBelow(folder_, name, text); }
  Outcome compare(std::vector<std::string> words) const {
    words.insert(words.begin(), "compare");
    return runHere(std::move(words));
  }
  void expectRefused(const std::vector<std::string>& words, const std::vector<std::string>& parts) const {
    const Outcome outcome = compare(words);
    EXPECT_EQ(outcome.exit_code, 2) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    for (const std::string& part : parts) EXPECT_NE(outcome.err.find(part), std::string::npos) << outcome.err;
  }
  test::TempFolder folder_;
};

TEST_F(CompareCommand, NamesTheCellsThatDiffer) {
  const Outcome outcome = compare({set("old"), set("new")});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.out,
            "changed changed: samples +2 -1, edited 1; segments +2 -1; length 20.0 to 31.2 um (+11.2)\n"
            "moved moved: by 5.000 um, turned by 0.0000 rad\n"
            "removed removed: 2 samples, 1.0 um\n"
            "added added: 3 samples, 4.0 um\n"
            "cells: 1 same, 1 moved, 1 changed, 1 added, 1 removed\n");
}

TEST_F(CompareCommand, RowsHaveTheSameFieldsInEveryForm) {
  const Outcome tsv = compare({set("old"), set("new"), "--tsv"});
  ASSERT_EQ(tsv.exit_code, 0) << tsv.err;
  EXPECT_EQ(tsv.out,
            "a\tb\tstate\tsamples_a\tsamples_b\tlength_a_um\tlength_b_um\tsamples_added\tsamples_removed\t"
            "samples_edited\tsegments_added\tsegments_removed\tmoved_um\tturned_rad\n"
            "changed\tchanged\tchanged\t3\t4\t20\t31.18033988749895\t2\t1\t1\t2\t1\t-\t-\n"
            "moved\tmoved\tmoved\t2\t2\t10\t10\t-\t-\t-\t-\t-\t5\t0\n"
            "removed\t-\tremoved\t2\t-\t1\t-\t-\t-\t-\t-\t-\t-\t-\n"
            "same\tsame\tsame\t2\t2\t10\t10\t-\t-\t-\t-\t-\t-\t-\n"
            "-\tadded\tadded\t-\t3\t-\t4\t-\t-\t-\t-\t-\t-\t-\n");
  const nlohmann::json all = nlohmann::json::parse(compare({set("old"), set("new"), "--within", "3", "--json"}).out);
  EXPECT_EQ(all["a"], set("old"));
  EXPECT_EQ(all["within_um"], 3);
  EXPECT_EQ(all["totals"], (nlohmann::json{{"same", 1}, {"moved", 1}, {"changed", 1}, {"added", 1}, {"removed", 1}}));
  ASSERT_EQ(all["cells"].size(), 5u);
  EXPECT_EQ(all["cells"][0]["state"], "changed");
  EXPECT_EQ(all["cells"][0]["max_a_um"], 5 * std::sqrt(4.0 / 5)) << "from (20 0 0) to the segment to (20 5 0)";
  EXPECT_EQ(all["cells"][0]["step_b_um"], 3 / 20.);
  EXPECT_TRUE(all["cells"][1]["max_a_um"].is_null()) << "of changed cells only";
  EXPECT_EQ(nlohmann::json::parse(compare({set("old"), set("new"), "--json"}).out)["within_um"], nullptr);
}

TEST_F(CompareCommand, TwoTracesHaveDistancesBothWays) {
  const Outcome text = compare({set("old"), "same", "moved"});
  EXPECT_EQ(text.out,
            "same same and moved\n"
            "  same (A): 10.0 um, 100.0 % of it within 2 um of the other; distance: mean 0.000, median 0.000, largest "
            "0.000 um\n"
            "  moved (B): 10.0 um, 100.0 % of it within 2 um of the other; distance: mean 0.000, median 0.000, largest "
            "0.000 um\n");
  const nlohmann::json of_two =
      nlohmann::json::parse(compare({set("old"), "same", set("new"), "moved", "--within", "5", "--json"}).out);
  ASSERT_EQ(of_two["cells"].size(), 1u);
  const nlohmann::json& row = of_two["cells"][0];
  EXPECT_EQ(row["a"], "same");
  EXPECT_EQ(row["b"], "moved");
  EXPECT_EQ(row["within_a_um"], 10);
  EXPECT_EQ(row["mean_b_um"], 5);
  EXPECT_EQ(row["max_b_um"], 5);
  // Files, and sets of one cell each.
  const nlohmann::json files =
      nlohmann::json::parse(compare({folder_ / "old/changed.swc", folder_ / "new/changed.swc", "--json"}).out);
  EXPECT_EQ(files["within_um"], 2);
  EXPECT_EQ(files["cells"][0]["state"], "changed");
  const nlohmann::json names =
      nlohmann::json::parse(compare({folder_ / "old/removed.swc", folder_ / "new/added.swc", "--json"}).out);
  EXPECT_EQ(names["cells"][0]["a"], "removed");
  EXPECT_EQ(names["cells"][0]["b"], "added");
}

TEST_F(CompareCommand, MistakesGetOneLine) {
  expectRefused({set("old"), set("old")}, {"A and B are the same", "two of its cells"});
  expectRefused({set("old"), set("old") + "/"}, {"A and B are the same"});
  expectRefused({set("old"), "same", "same"}, {"both are the cell", "same"});
  expectRefused({set("old"), "sane", "moved"}, {"sane", "did you mean 'same'?"});
  expectRefused({set("old"), "same", set("new"), "movde"}, {"movde", "did you mean 'moved'?"});
  for (const char* const within : {"0", "-1", "nan", "inf", "2um"})
    expectRefused({set("old"), set("new"), "--within", within}, {"--within"});
  expectRefused({set("old"), set("new"), "--memory", "1M"}, {"--memory"});
  expectRefused({set("old")}, {"SET"});
  for (const std::string& no_set : {folder_ / "old", folder_ / "nowhere.fil"}) {
    const Outcome outcome = compare({set("old"), no_set});
    EXPECT_NE(outcome.exit_code, 0);
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  }
}

}  // namespace
}  // namespace filiform
