// A set with more packs than a process may have open files.
#include "index/cell/cell.h"
#include "index/ingest/ingest.h"
#include "tests/support/process.h"
#include "tests/support/sanitized.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/temp_folder.h"

#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

class ManyPacks : public ::testing::Test {
 protected:
  void SetUp() override {
    CellList cells(test::randomColumn(9, 8, 500, 300));
    ingest(cells, folder_ / "a.fil", {.capacity = 64, .pack_bytes = 1500, .levels = true});
    std::size_t packs = 0;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder_ / "a.fil"))
      packs += entry.path().extension() == ".pack";
    ASSERT_GT(packs, 30u);
  }
  test::TempFolder folder_;
};

TEST_F(ManyPacks, EveryCommandGivesTheSameWithFewDescriptors) {
  if (test::kSanitized) GTEST_SKIP() << "the sanitizer needs descriptors itself";
  const std::string set = folder_ / "a.fil";
  test::writeBytes(folder_ / "points.txt", "0 0 0\n50 20 -30\n-90 100 8\n120 -40 70\n");
  for (const std::vector<std::string>& command : std::vector<std::vector<std::string>>{
           {"info", set},
           {"verify", "--deep", set},
           {"nearest", set, "--points", folder_ / "points.txt", "--k", "40"},
           {"nearest", set, "0", "0", "0", "--radius", "80"},
           {"navigate", set, "--route", "tour:1", "--seconds", "2"},
           {"navigate", set, "--route", "tour:1", "--seconds", "0.2", "--realtime"}}) {
    SCOPED_TRACE(command[0] + " " + command.back());
    const test::Outcome free = test::runFiliform(command);
    EXPECT_EQ(free.exit_code, 0) << free.err;
    const test::Outcome bound = test::runFiliformInShell("ulimit -n 14; exec \"$@\"", command);
    EXPECT_EQ(bound.exit_code, 0) << bound.err;
    if (command[0] != "navigate") {  // navigate also prints times
      EXPECT_EQ(bound.out, free.out);
    }
  }
}

}  // namespace
}  // namespace filiform
