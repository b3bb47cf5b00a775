// Inputs that a user may not read: each is refused, the others are ingested.
#include "tests/support/process.h"
#include "tests/support/temp_folder.h"

#include <filesystem>
#include <string>
#include <unistd.h>

#include <gtest/gtest.h>

namespace filiform {
namespace {

namespace fs = std::filesystem;
using test::Outcome;

const std::string kTwoSampleFile = "1 1 0 0 0 5 -1\n2 3 0 6 0 1 1\n";

class Unreadable : public ::testing::Test {
 protected:
  void SetUp() override {
    fs::permissions(folder_.path(), fs::perms::all);
    fs::create_directories(folder_ / "in/locked");
    fs::create_directories(folder_ / "in/open");
    fs::create_directory(folder_ / "out");
    fs::permissions(folder_ / "out", fs::perms::all);
    for (const char* name : {"in/a.swc", "in/b.swc", "in/locked/c.swc", "in/open/d.swc", "in/e.zip"})
      test::writeBytes(folder_ / name, kTwoSampleFile);
    for (const char* name : {"in/b.swc", "in/locked", "in/e.zip"}) fs::permissions(folder_ / name, fs::perms::none);
    if (run({"--version"}).exit_code != 0) GTEST_SKIP() << "the program cannot be run as another user (setpriv)";
  }
  void TearDown() override { fs::permissions(folder_ / "in/locked", fs::perms::owner_all); }

  // Root may read every file. If root runs this test, the program runs as the user `nobody`, who may not.
  static Outcome run(const std::vector<std::string>& arguments) {
    return test::runFiliformInShell(
        ::geteuid() == 0 ? "exec setpriv --reuid 65534 --regid 65534 --clear-groups \"$@\"" : "exec \"$@\"", arguments);
  }

  test::TempFolder folder_;
};

TEST_F(Unreadable, CheckNamesEachAndGoesOn) {
  const Outcome outcome = run({"check", folder_ / "in"});
  EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  EXPECT_TRUE(
      outcome.out.starts_with("5 inputs: 2 accepted, 0 with warnings, 3 refused; 4 samples, 2 segments kept\n"
                              "  refused b.swc: cannot open: Permission denied (E_UNREADABLE)\n"
                              "  refused e.zip: cannot open: Permission denied (E_UNREADABLE)\n"
                              "  refused locked: cannot list the folder: Permission denied (E_UNREADABLE)\n"))
      << outcome.out;
  const Outcome table = run({"check", "--tsv", folder_ / "in"});
  EXPECT_EQ(table.exit_code, 1);
  EXPECT_EQ(
      table.out,
      "file\tseverity\tsamples\tsegments\tdropped\tcodes\n"
      "a.swc\taccept\t2\t1\t-\t-\nb.swc\trefuse\t0\t0\t-\tE_UNREADABLE:1\ne.zip\trefuse\t0\t0\t-\tE_UNREADABLE:1\n"
      "locked\trefuse\t0\t0\t-\tE_UNREADABLE:1\nopen/d.swc\taccept\t2\t1\t-\t-\n");
}

TEST_F(Unreadable, IngestTakesTheOthersUnlessStrict) {
  const Outcome outcome = run({"ingest", folder_ / "in", "-o", folder_ / "out/a.fil"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("2 accepted, 0 with warnings, 3 refused"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("refused b.swc: cannot open: Permission denied"), std::string::npos) << outcome.out;
  EXPECT_EQ(run({"verify", "--deep", folder_ / "out/a.fil"}).exit_code, 0);

  const Outcome strict =
      run({"ingest", "--strict", folder_ / "in", "-o", folder_ / "out/b.fil", "--report", folder_ / "out/b.json"});
  EXPECT_EQ(strict.exit_code, 1);
  EXPECT_NE(strict.err.find("3 of 5 inputs refused, nothing written; the first is b.swc: cannot open"),
            std::string::npos)
      << strict.err;
  EXPECT_FALSE(fs::exists(folder_ / "out/b.fil"));
  EXPECT_NE(test::readBytes(folder_ / "out/b.json").find("\"fate\": \"refused\""), std::string::npos);
}

TEST_F(Unreadable, IngestOfNothingElseExitsOneWithTheReason) {
  const Outcome outcome = run({"ingest", folder_ / "in/b.swc", "-o", folder_ / "out/a.fil"});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_NE(outcome.err.find("b.swc: cannot open: Permission denied"), std::string::npos) << outcome.err;
  EXPECT_TRUE(outcome.oneLineOnStderr()) << outcome.err;
  EXPECT_FALSE(fs::exists(folder_ / "out/a.fil"));
}

TEST_F(Unreadable, AFileNamedThatDoesNotExistExitsThree) {
  const Outcome outcome = run({"check", folder_ / "in/a.swc", folder_ / "in/none.swc"});
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_NE(outcome.err.find("none.swc"), std::string::npos) << outcome.err;
}

}  // namespace
}  // namespace filiform
