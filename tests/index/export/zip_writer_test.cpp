#include "index/export/zip_writer.h"

#include "index/errors.h"
#include "tests/support/temp_folder.h"
#include "tools/words/making/output_folder.h"

#include <filesystem>
#include <stdexcept>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

namespace fs = std::filesystem;

TEST(ZipWriter, PassesOnWhatFailsAndLeavesNothing) {
  const test::TempFolder folder;
  ZipContent content;
  content.entries = 3;
  content.name = [](std::size_t i) { return std::to_string(i); };
  content.text = [](std::size_t i) -> std::string {
    if (i == 1) throw std::runtime_error("no text");
    return "text";
  };
  EXPECT_THROW(writeZip(folder / "a.zip", "a.zip", content), std::runtime_error);
  EXPECT_TRUE(fs::is_empty(folder.path()));
  content.text = [](std::size_t) { return std::string("text"); };
  EXPECT_THROW(writeZip(folder / "no/a.zip", "a.zip", content), IoError);
  const std::uint64_t bytes = writeZip(folder / "a.zip", "a.zip", content);
  EXPECT_EQ(bytes, fs::file_size(folder / "a.zip"));
}

TEST(OutputFolder, RemovesWhatItMadeUnlessItIsFinished) {
  const test::TempFolder folder;
  fs::create_directory(folder / "empty");
  for (const char* name : {"empty", "new"}) {
    OutputFolder out(folder / name);
    out.makeFolder("inner");
    out.write("a", "text");
    out.write("inner/b", "text");
  }
  EXPECT_TRUE(fs::is_empty(folder / "empty"));
  EXPECT_FALSE(fs::exists(folder / "new"));
  {
    OutputFolder out(folder / "new/");
    out.write("a", "text");
    out.finish();
  }
  EXPECT_EQ(test::readBytes(folder / "new/a"), "text");
  EXPECT_THROW(OutputFolder(folder / "new"), InputError);
  EXPECT_THROW(OutputFolder(folder / "new/a"), InputError);
  EXPECT_THROW(OutputFolder(folder / "no/such"), IoError);
}

TEST(OutputFolder, MakesNamesSafeAndDifferent) {
  EXPECT_EQ(safeFileName("cell_00042"), "cell_00042");
  EXPECT_EQ(safeFileName("../a b/c\n\x1b"), "_._a_b_c_n_x1b");
  EXPECT_EQ(safeFileName("-rf"), "_rf");
  EXPECT_EQ(safeFileName(""), "cell");
  EXPECT_EQ(safeFileName("n\xc3\xa9"), "n\xc3\xa9");
  EXPECT_EQ(safeFileName("n\xe9"), "n_xe9");
  EXPECT_LE(safeFileName(std::string(1000, 'x')).size(), 200u);
  EXPECT_EQ(safeFileNames({"a", "A", "a", "a-2", "b"}), (std::vector<std::string>{"a", "A-2", "a-3", "a-2-2", "b"}));
}

}  // namespace
}  // namespace filiform::tools
