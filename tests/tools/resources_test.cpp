// Too few resources or extreme inputs: one clear line and the documented exit code, or the work is done within the
// available memory.
#include "tests/support/process.h"
#include "tests/support/sanitized.h"
#include "tests/support/temp_folder.h"
#include "tests/support/zip_builder.h"
#include "tools/commands/commands.h"
#include "tools/program/cli.h"

#include <cstdlib>
#include <filesystem>
#include <functional>
#include <new>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

namespace filiform {
namespace {

namespace fs = std::filesystem;
using test::Outcome;
using test::runFiliform;
using test::runFiliformInShell;

std::string row(int id, double x_um, double y_um, int parent) {
  std::string text = std::to_string(id);
  text += " 3 " + std::to_string(x_um) + " " + std::to_string(y_um) + " 0 1 ";
  return text += std::to_string(parent) + "\n";
}

class Resources : public ::testing::Test {
 protected:
  std::string path(const std::string& name) const { return folder_ / name; }
  // Either the work was done, or one line says why not and nothing is left.
  void expectDoneOrRefused(const Outcome& outcome, const std::string& set) {
    EXPECT_TRUE(outcome.exit_code == 0 || outcome.exit_code == 3) << outcome.exit_code << outcome.err;
    if (outcome.exit_code == 0) return;
    ++refused_;
    EXPECT_TRUE(outcome.oneLineOnStderr()) << outcome.err;
    EXPECT_EQ(outcome.err.find("internal error"), std::string::npos) << outcome.err;
    EXPECT_FALSE(fs::exists(set)) << outcome.err;
  }
  void writeCell() {
    std::string text = "1 1 0 0 0 5 -1\n";
    for (int i = 2; i < 3000; ++i) text += row(i, i, i % 7, i - 1);
    test::writeBytes(path("cell.swc"), text);
  }

  test::TempFolder folder_;
  int refused_ = 0;
};

TEST_F(Resources, TooFewFileDescriptors) {
  if (test::kSanitized) GTEST_SKIP() << "a sanitizer needs some of its own";
  writeCell();
  const auto limited = [](int most) { return "ulimit -n " + std::to_string(most) + "; exec \"$@\""; };
  int first = 4;  // the smallest number with which the program starts
  while (runFiliformInShell(limited(first), {"--version"}).exit_code != 0) ASSERT_LT(++first, 32);
  for (int most = first; most < first + 12; most += 2) {
    SCOPED_TRACE(most);
    const std::string set = path(std::to_string(most) + ".fil");
    expectDoneOrRefused(runFiliformInShell(limited(most), {"ingest", path("cell.swc"), "-o", set, "--capacity", "100"}),
                        set);
  }
  EXPECT_GT(refused_, 0);
  EXPECT_LT(refused_, 6);
}

TEST_F(Resources, TooLittleMemory) {
  if (test::kSanitized) GTEST_SKIP() << "a sanitizer takes terabytes of addresses";
  std::string text;
  for (int i = 1; i < 100000; ++i) text += row(i, i % 1000, i / 1000, i == 1 ? -1 : i - 1);
  test::writeBytes(path("cell.swc"), text);
  const auto limited = [](int kib) { return "ulimit -v " + std::to_string(kib) + "; exec \"$@\""; };
  int first = 30000;  // its libraries alone need some
  while (runFiliformInShell(limited(first), {"--version"}).exit_code != 0) ASSERT_LT(first += 2000, 200000);
  for (const int kib : {first, first + 5000, first + 15000, 2000000}) {
    SCOPED_TRACE(kib);
    const std::string set = path(std::to_string(kib) + ".fil");
    expectDoneOrRefused(runFiliformInShell(limited(kib), {"ingest", path("cell.swc"), "-o", set, "--threads", "2"}),
                        set);
  }
  EXPECT_GT(refused_, 0);
  EXPECT_LT(refused_, 4);
}

TEST_F(Resources, NoMemoryWhereNoneMayThrow) {
  // Like the destructor of a JSON value, which allocates.
  const auto destroy = [](const std::function<void()>& within) noexcept {
    tools::endPlainlyWithoutMemory();
    within();
  };
  EXPECT_EXIT(destroy([] { throw std::bad_alloc(); }), ::testing::ExitedWithCode(3),
              "^filiform: out of memory[^\n]*\n$");
  EXPECT_DEATH(destroy([] { throw std::runtime_error("of its own"); }), "of its own");
}

TEST_F(Resources, AFolderThatMayNotBeWritten) {
  writeCell();
  fs::create_directory(path("mount"));
  const std::string mount = "mount --bind " + path("mount") + " " + path("mount") + " && mount -o remount,bind,ro " +
                            path("mount") + " || exit 99; ";
  if (std::system(("unshare -rm bash -c '" + mount + "' 2>/dev/null").c_str()) != 0)
    GTEST_SKIP() << "this kernel refuses a private read-only mount (unshare -rm)";
  const Outcome outcome = runFiliformInShell("exec unshare -rm bash -c '" + mount + "exec \"$@\"' bash \"$@\"",
                                             {"ingest", path("cell.swc"), "-o", path("mount/x.fil")});
  EXPECT_EQ(outcome.exit_code, 3) << outcome.err;
  EXPECT_TRUE(outcome.oneLineOnStderr()) << outcome.err;
  EXPECT_NE(outcome.err.find("Read-only"), std::string::npos) << outcome.err;
}

// 24 MB that are 24 kB in the archive: blank lines, which need no memory.
TEST_F(Resources, AZipBombIsReadAsItUnpacks) {
  if (test::kSanitized) GTEST_SKIP() << "a sanitizer takes terabytes of addresses";
  test::ZipMember bomb;
  bomb.name = "bomb.swc";
  bomb.content = "1 1 0 0 0 1 -1\n";
  bomb.content.append(24 << 20, '\n');
  test::writeDeflatedZip(path("bomb.zip"), {bomb});
  const std::uintmax_t packed = fs::file_size(path("bomb.zip"));
  EXPECT_LT(packed, 100000u);
  const Outcome outcome = runFiliformInShell("ulimit -v 100000; exec \"$@\"", {"check", "--tsv", path("bomb.zip")});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("bomb.zip\t"), std::string::npos) << outcome.out;
}

TEST_F(Resources, LinesCombsAndHubsBeyondAllMeasure) {
  // A line of 70 kB among good lines, a comb of 200 000 twigs, a hub of 5000 branches.
  std::string text = "1 1 0 0 0 5 -1\n2 3 " + std::string(70000, '1') + " 0 0 1 1\n";
  test::writeBytes(path("line.swc"), text + "3 3 1 0 0 1 1\n");
  const Outcome line = runFiliform({"check", "--tsv", path("line.swc")});
  EXPECT_EQ(line.exit_code, 0) << line.err;
  EXPECT_NE(line.out.find("W_LONG_LINE"), std::string::npos) << line.out.substr(0, 200);
  EXPECT_LT(line.out.size(), 2000u) << "the message about a line does not grow with the line";

  const int twigs = test::kSanitized ? 20000 : 200000;
  text = "1 1 0 0 0 5 -1\n";
  for (int i = 1; i <= twigs; ++i) {
    text += row(2 * i, i, 0, i == 1 ? 1 : 2 * i - 2);
    text += row(2 * i + 1, i, 1, 2 * i);
  }
  test::writeBytes(path("comb.swc"), text);
  text = "1 1 0 0 0 5 -1\n";
  for (int i = 2; i <= 5001; ++i) text += row(i, 100 + i % 71, i / 71.0, 1);
  test::writeBytes(path("hub.swc"), text);
  for (const char* name : {"comb", "hub"}) {
    SCOPED_TRACE(name);
    const std::string set = path(std::string(name) + ".fil");
    const Outcome made = runFiliform({"ingest", path(std::string(name) + ".swc"), "-o", set});
    EXPECT_EQ(made.exit_code, 0) << made.err;
    const Outcome travelled = runFiliform({"navigate", set, "--seconds", "0.2", "--zoom", "100", "--json"});
    EXPECT_EQ(travelled.exit_code, 0) << travelled.err;
    EXPECT_EQ(runFiliform({"nearest", set, "3", "1", "0"}).exit_code, 0);
  }
}

}  // namespace
}  // namespace filiform
