// ingest --add, ingest --remove and compact.
#include "tests/support/process.h"
#include "tests/support/temp_folder.h"

#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform {
namespace {

using test::runFiliform;

class GrowthCommands : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto write = [&](const char* name, int samples, int y) {
      std::string text;
      for (int i = 1; i <= samples; ++i)
        text += std::to_string(i) + " 3 " + std::to_string(3 * i) + " " + std::to_string(y) + " " +
                std::to_string(i % 4) + " 0.5 " + std::to_string(i == 1 ? -1 : i - 1) + "\n";
      test::writeBytes(folder_ / name, text);
    };
    write("a.swc", 400, 0);
    write("b.swc", 300, 20);
    write("c.swc", 80, 10);
    const auto made = runFiliform({"ingest", folder_ / "a.swc", folder_ / "b.swc", "-o", set_});
    ASSERT_EQ(made.exit_code, 0) << made.err;
  }
  std::string names() const { return runFiliform({"cells", set_, "--tsv"}).out; }
  std::string current() const { return test::readBytes(set_ + "/CURRENT"); }

  test::TempFolder folder_;
  std::string set_ = folder_ / "s.fil";
};

TEST_F(GrowthCommands, AddRemoveAndCompact) {
  const std::string before = current();
  auto outcome = runFiliform({"ingest", "--add", folder_ / "c.swc", "-o", set_});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("3 cells"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("filiform compact"), std::string::npos) << outcome.out;
  EXPECT_NE(names().find("\tc\t"), std::string::npos) << names();
  EXPECT_EQ(runFiliform({"verify", "--deep", set_}).exit_code, 0);

  outcome = runFiliform({"ingest", "--remove", "c", "-o", set_});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(names().find("\tc\t"), std::string::npos) << names();
  EXPECT_EQ(runFiliform({"nearest", set_, "30", "10", "0", "--tsv"}).exit_code, 0);
  EXPECT_EQ(runFiliform({"verify", "--deep", set_}).exit_code, 0);

  outcome = runFiliform({"compact", set_});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(runFiliform({"verify", "--deep", set_}).exit_code, 0);
  EXPECT_NE(current(), before) << "the provenance keeps c.swc";
}

TEST_F(GrowthCommands, CompactSetsAreAsOneIngest) {
  ASSERT_EQ(runFiliform({"ingest", "--add", folder_ / "c.swc", "-o", set_}).exit_code, 0);
  ASSERT_EQ(runFiliform({"compact", set_}).exit_code, 0);
  const std::string all = folder_ / "all.fil";
  ASSERT_EQ(runFiliform({"ingest", folder_ / "a.swc", folder_ / "b.swc", folder_ / "c.swc", "-o", all}).exit_code, 0);
  EXPECT_EQ(current(), test::readBytes(all + "/CURRENT"));
}

TEST_F(GrowthCommands, ASetFollowsItsFolder) {
  const std::string lab = folder_ / "lab", set = folder_ / "lab.fil", report = folder_ / "r.json";
  std::filesystem::create_directories(lab);
  for (const char* const name : {"a.swc", "b.swc"}) std::filesystem::copy(folder_ / name, lab);
  auto outcome = runFiliform({"ingest", "--sync", lab, "-o", set});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("lab.fil: 2 new cells, 0 changed, 0 equal, 0 removed\n"), std::string::npos)
      << outcome.out;
  std::filesystem::copy(folder_ / "c.swc", lab);
  std::filesystem::remove(lab + "/b.swc");
  outcome = runFiliform({"ingest", "--sync", lab, "-o", set, "--report", report});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(
      outcome.out.find("1 new cell, 0 changed, 1 equal, 0 removed\n  1 cell of the set is no longer in the input and "
                       "stays; --delete removes it\n"),
      std::string::npos)
      << outcome.out;
  const nlohmann::json files = nlohmann::json::parse(test::readBytes(report));
  ASSERT_EQ(files.size(), 3u);
  EXPECT_EQ(files.at(0).at("sync"), "equal");
  EXPECT_EQ(files.at(1).at("sync"), "new");
  EXPECT_EQ(files.at(2), nlohmann::json({{"file", "b.swc"}, {"sync", "gone"}}));
  outcome = runFiliform({"ingest", "--sync", lab, "-o", set, "--delete", "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const nlohmann::json json = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(json.at("sync").at("removed"), 1);
  EXPECT_EQ(json.at("sync").at("equal"), 2);
  EXPECT_EQ(json.at("cells"), 2);
  EXPECT_EQ(runFiliform({"verify", "--deep", set}).exit_code, 0);
  outcome = runFiliform({"ingest", "--sync", lab, "-o", set, "--delete"});
  EXPECT_NE(outcome.out.find("unchanged"), std::string::npos) << outcome.out;
}

TEST_F(GrowthCommands, RefusalsSayWhatToDo) {
  const std::string before = current();
  const auto refused = [&](const std::vector<std::string>& arguments, int code, const char* text) {
    const auto outcome = runFiliform(arguments);
    EXPECT_EQ(outcome.exit_code, code) << outcome.err;
    EXPECT_TRUE(outcome.oneLineOnStderr()) << outcome.err;
    EXPECT_NE(outcome.err.find(text), std::string::npos) << outcome.err;
  };
  refused({"ingest", "--add", folder_ / "a.swc", "-o", set_}, 1, "already has a cell named a");
  refused({"ingest", "--remove", "nobody", "-o", set_}, 2, "filiform cells");
  refused({"ingest", "--remove", "a", folder_ / "c.swc", "-o", set_}, 2, "--remove");
  refused({"ingest", "--add", "--force", folder_ / "c.swc", "-o", set_}, 2, "--force");
  refused({"ingest", "--add", folder_ / "c.swc", "-o", folder_ / "none.fil"}, 3, "filiform ingest");
  refused({"ingest", "-o", set_}, 2, "INPUT");
  refused({"compact", folder_ / "none.fil"}, 3, "filiform ingest");
  refused({"ingest", "--sync", "--add", folder_ / "c.swc", "-o", set_}, 2, "--sync");
  refused({"ingest", "--sync", "--force", folder_ / "c.swc", "-o", set_}, 2, "--force");
  refused({"ingest", "--delete", folder_ / "c.swc", "-o", set_}, 2, "--remove CELL");
  std::filesystem::create_directories(folder_ / "empty");
  refused({"ingest", "--sync", "--delete", folder_ / "empty", "-o", set_}, 1, "empty");
  refused({"ingest", "--sync", "--delete", folder_ / "absent", "-o", set_}, 3, "absent");
  EXPECT_EQ(current(), before);
}

}  // namespace
}  // namespace filiform
