// What `ingest -o` refuses to write to, and to remove.
#include "tests/support/process.h"
#include "tests/support/temp_folder.h"

#include <filesystem>
#include <string>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::Outcome;
using test::runFiliform;

TEST(IngestFolders, APlaceInsideASetAndTheNameOfAnInputAreRefusedInOneLine) {
  const test::TempFolder folder;
  const std::string cell = folder.file("cell.swc"), set = folder.file("a.fil");
  test::writeBytes(cell, "1 1 0 0 0 5 -1\n2 3 10 0 0 1 1\n");
  ASSERT_EQ(runFiliform({"ingest", cell, "-o", set}).exit_code, 0);
  for (const std::string& out : {folder.file("new.swc"), folder.file("a.ZIP"), set + "/inner.fil"}) {
    const Outcome outcome = runFiliform({"ingest", cell, "-o", out});
    EXPECT_EQ(outcome.exit_code, 1) << out;
    EXPECT_TRUE(outcome.oneLineOnStderr()) << outcome.err;
    EXPECT_FALSE(std::filesystem::exists(out));
  }
}

TEST(IngestFolders, AFolderOfAUserIsNotRemoved) {
  const test::TempFolder folder;
  const std::string cell = folder.file("cell.swc"), photo = folder.file("a.fil/holiday.tmp-2024/photo.txt");
  test::writeBytes(cell, "1 1 0 0 0 5 -1\n2 3 10 0 0 1 1\n");
  test::writeBelow(folder, "a.fil/holiday.tmp-2024/photo.txt", "precious");
  const Outcome outcome = runFiliform({"ingest", cell, "-o", folder.file("a.fil")});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_TRUE(outcome.oneLineOnStderr()) << outcome.err;
  EXPECT_EQ(test::readBytes(photo), "precious");
}

}  // namespace
}  // namespace filiform
