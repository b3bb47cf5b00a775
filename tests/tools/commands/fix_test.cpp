// filiform fix as users run it: clean files, a record of each change, and the same bytes the second time.
#include "tests/support/process.h"
#include "tests/support/temp_folder.h"

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

namespace fs = std::filesystem;
using test::Outcome;
using test::runFiliform;

std::map<std::string, std::string> swcFilesIn(const std::string& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.path().extension() == ".swc") files[entry.path().filename()] = test::readBytes(entry.path());
  return files;
}

void writeMessyFolder(const test::TempFolder& folder) {
  test::writeBelow(folder, "in/semicolons.swc",
                   "\xEF\xBB\xBF# head\n1;1;0;0;0;5;-1\n2;3;0;6;0;NaN;1\n# late\n2;3;9;9;9;1;1\n");
  test::writeBelow(folder, "in/late.swc", "1 1 0 0 0 5 -1\n3 3 0 9 0 1 2\n2 3 0 6 0 1 1\n4 3 0 8 0 1 77\n");
  test::writeBelow(folder, "in/sub/late.swc", "1 1 0 0 0 5.25 -1\r\n2 3 0.1 6 1e-3 1 1\r\n");
  test::writeBelow(folder, "in/empty.swc", "");
}

TEST(Fix, WritesCleanFilesAndARecordOfEachChange) {
  const test::TempFolder folder;
  writeMessyFolder(folder);
  const Outcome outcome = runFiliform({"fix", folder / "in", "-o", folder / "out/"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("3 files; 2 repairs; "), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("refused empty.swc"), std::string::npos) << outcome.out;
  const auto files = swcFilesIn(folder / "out");
  ASSERT_EQ(files.size(), 3u);
  EXPECT_EQ(files.at("semicolons.swc"), "# head\n1 1 0 0 0 5 -1\n2 3 0 6 0 0 1\n");
  EXPECT_TRUE(files.contains("sub_late.swc"));
  EXPECT_EQ(files.at("sub_late.swc"), "1 1 0 0 0 5.25 -1\n2 3 0.1 6 0.001 1 1\n");
  const std::string changes = test::readBytes(folder / "out/changes.tsv");
  for (const char* row : {"source\tline\tsample\tchange\tdetail\n", "semicolons.swc\t5\t-\tW_DUP_ID\tdropped: ",
                          "semicolons.swc\t3\t2\tunknown_radius\tradius unknown; written as 0\n",
                          "semicolons.swc\t-\t-\tcomments_left_out\t1 ",
                          "late.swc\t4\t-\tW_MISSING_PARENT\tcut: ", "late.swc\t-\t-\tparents_first\t",
                          "empty.swc\t-\t-\tE_NO_SAMPLES\t", "sub/late.swc\t-\t-\twritten\tsub_late.swc\n"})
    EXPECT_NE(changes.find(row), std::string::npos) << row << "\n" << changes;
  // All that was written is accepted, but for the radius of 0.
  const Outcome check = runFiliform({"check", folder / "out", "--tsv"});
  EXPECT_EQ(check.exit_code, 0);
  EXPECT_EQ(check.out.find("W_ORDER"), std::string::npos) << check.out;
  EXPECT_EQ(check.out.find("W_BAD"), std::string::npos) << check.out;
}

TEST(Fix, TwiceGivesTheSameBytes) {
  const test::TempFolder folder;
  writeMessyFolder(folder);
  std::string gap = "1 1 0 0 0 5 -1\n2 3 6 0 0 1 1\n3 3 12 1 0 1 2\n4 3 14 1 1 1 -1\n5 3 20 0 1 1 4\n";
  test::writeBelow(folder, "in/gap.swc", gap + "6 2 900 0 0 1 1\n7 2 906 0 0 1 6\n8 2 911 0 0 x 7\n");
  for (const std::vector<std::string>& options :
       {std::vector<std::string>{},
        std::vector<std::string>{"--drop-long-links", "--join-gaps", "5", "--soma-links", "--unknown-radius", "0.5"}}) {
    const std::string name = options.empty() ? "plain" : "all";
    const auto fix = [&](const std::string& in, const std::string& out) {
      std::vector<std::string> words = {"fix", folder / in, "-o", folder / out};
      words.insert(words.end(), options.begin(), options.end());
      const Outcome outcome = runFiliform(words);
      EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
      return outcome.out;
    };
    fix("in", name + "1");
    EXPECT_NE(fix(name + "1", name + "2").find("; 0 repairs; "), std::string::npos);
    const auto once = swcFilesIn(folder / (name + "1"));
    EXPECT_EQ(once.size(), 4u);
    EXPECT_EQ(once, swcFilesIn(folder / (name + "2")));
  }
  const std::string changes = test::readBytes(folder / "all1/changes.tsv");
  EXPECT_NE(changes.find("gap.swc\t6\t6\tlink_dropped\tlink to sample 1, 900 um\n"), std::string::npos) << changes;
  EXPECT_NE(changes.find("gap.swc\t4\t4\tgap_joined\tparent is now sample 3, "), std::string::npos) << changes;
}

// Two cells that a long link made one.
TEST(Fix, CellsThatADroppedLinkJoinedBecomeFiles) {
  const test::TempFolder folder;
  std::string text = "# two cells\n";
  for (int i = 0; i < 42; ++i)
    text += std::to_string(i + 1) + (i % 21 == 0 ? " 1 " : " 3 ") + std::to_string(i % 21 * 3 + i / 21 * 900) + " " +
            std::to_string(i % 3) + " " + std::to_string(i % 2) + " 1 " + (i == 0 ? "-1" : std::to_string(i)) + "\n";
  test::writeBelow(folder, "in/a.swc", text);
  const auto fix = [&](const std::string& in, const std::string& out) {
    const Outcome outcome = runFiliform({"fix", folder / in, "-o", folder / out, "--drop-long-links"});
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return swcFilesIn(folder / out);
  };
  const auto once = fix("in", "out1");
  ASSERT_EQ(once.size(), 2u);
  EXPECT_TRUE(once.at("a_2.swc").starts_with("# two cells\n22 1 900 0 1 1 -1\n")) << once.at("a_2.swc");
  const std::string changes = test::readBytes(folder / "out1/changes.tsv");
  for (const char* row : {"a.swc\t23\t22\tlink_dropped\tlink to sample 21, ", "a.swc\t-\t-\twritten\ta_1.swc\n",
                          "a.swc\t-\t-\twritten\ta_2.swc\n"})
    EXPECT_NE(changes.find(row), std::string::npos) << row << changes;
  EXPECT_EQ(fix("out1", "out2"), once);
  EXPECT_EQ(
      runFiliform({"fix", folder / "in", "-o", folder / "whole", "--drop-long-links", "--one-cell-a-file"}).exit_code,
      0);
  EXPECT_EQ(swcFilesIn(folder / "whole").size(), 1u);
}

TEST(Fix, NamesTheOffsetAndTheUnit) {
  const test::TempFolder folder;
  test::writeBelow(folder, "a.swc", "# OFFSET 10 20 30.5\n1 1 0 0 0 5 -1\n2 3 0 6 0 1 1\n");
  EXPECT_EQ(runFiliform({"fix", folder / "a.swc", "-o", folder / "out", "--apply-offset", "--unit", "nm"}).exit_code,
            0);
  EXPECT_NE(swcFilesIn(folder / "out").at("a.swc").find("\n1 1 0.01 0.02 0.0305 0.005 -1\n"), std::string::npos);
  const std::string changes = test::readBytes(folder / "out/changes.tsv");
  EXPECT_NE(changes.find("a.swc\t-\t-\toffset_added\tthe OFFSET of the header: 10 20 30.5\n"), std::string::npos)
      << changes;
  EXPECT_NE(changes.find("-\t-\t-\tunit\t--unit nm: "), std::string::npos) << changes;
}

TEST(Fix, ReplacesFilesOnlyWithForceAndNeverItsInput) {
  const test::TempFolder folder;
  writeMessyFolder(folder);
  test::writeBelow(folder, "out/semicolons.swc", "mine");
  const Outcome refused = runFiliform({"fix", folder / "in", "-o", folder / "out"});
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_TRUE(refused.oneLineOnStderr()) << refused.err;
  EXPECT_EQ(test::readBytes(folder / "out/semicolons.swc"), "mine");
  EXPECT_EQ(runFiliform({"fix", folder / "in", "-o", folder / "out", "--force"}).exit_code, 0);
  EXPECT_NE(test::readBytes(folder / "out/semicolons.swc"), "mine");
  const Outcome same = runFiliform({"fix", folder / "in", "-o", folder / "in", "--force"});
  EXPECT_NE(same.exit_code, 0);
  EXPECT_TRUE(same.oneLineOnStderr()) << same.err;
}

TEST(Fix, MistakesAreOneLine) {
  const test::TempFolder folder;
  writeMessyFolder(folder);
  for (const std::vector<std::string>& more :
       {std::vector<std::string>{"--join-gaps", "-1"}, std::vector<std::string>{"--join-gaps", "wide"},
        std::vector<std::string>{"--join-gaps", "1e9"}, std::vector<std::string>{"--unknown-radius", "nan"},
        std::vector<std::string>{"--unknown-radius", "-1"}}) {
    std::vector<std::string> words = {"fix", folder / "in", "-o", folder / "out"};
    words.insert(words.end(), more.begin(), more.end());
    const Outcome outcome = runFiliform(words);
    EXPECT_EQ(outcome.exit_code, 2) << more[1];
    EXPECT_TRUE(outcome.oneLineOnStderr()) << outcome.err;
    EXPECT_FALSE(fs::exists(folder / "out"));
  }
  test::writeBelow(folder, "in/loop.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nl 1 2 3 1\n");
  for (const char* input : {"in/empty.swc", "in/loop.obj"}) {
    const Outcome nothing = runFiliform({"fix", folder / input, "-o", folder / "out"});
    EXPECT_EQ(nothing.exit_code, 1);
    EXPECT_TRUE(nothing.oneLineOnStderr()) << nothing.err;
    EXPECT_FALSE(fs::exists(folder / "out"));
  }
}

}  // namespace
}  // namespace filiform
