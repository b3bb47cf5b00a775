#include "index/tile_source.h"

#include "index/errors.h"
#include "tests/support/temp_folder.h"

#include <filesystem>

#include <gtest/gtest.h>

namespace filiform {
namespace {

TEST(TileSource, NamesCannotLeaveTheFolder) {
  for (const char* good : {"CURRENT", "r-0123456789abcdef/tiles-00000.pack", "a_b.c"})
    EXPECT_TRUE(isTileFileName(good)) << good;
  for (const char* bad :
       {"", "/etc/passwd", "../x", "a/../b", "a//b", "a/", ".hidden", "a b", "a\n", "a:b", "\xc3\xa4"})
    EXPECT_FALSE(isTileFileName(bad)) << bad;
}

TEST(Folder, ReadsRangesOfWhatItOpened) {
  const test::TempFolder folder;
  test::writeBytes(folder / "file", "0123456789");
  const auto source = openFolder(folder.path());
  EXPECT_EQ(source->size("file"), 10u);
  std::filesystem::remove(folder / "file");
  std::vector<std::uint8_t> bytes(4);
  source->read("file", 3, bytes);
  EXPECT_EQ(std::string(bytes.begin(), bytes.end()), "3456");
  EXPECT_EQ(source->describe("file"), folder / "file");
}

TEST(Folder, SaysWhatIsMissing) {
  const test::TempFolder folder;
  EXPECT_THROW(openFolder(folder / "none"), IoError);
  const auto source = openFolder(folder.path());
  EXPECT_THROW(source->size("none"), IoError);
  EXPECT_THROW(source->size("../none"), UsageError);
  std::filesystem::create_directory(folder / "sub");
  EXPECT_THROW(source->size("sub"), IoError);
  test::writeBytes(folder / "file", "0123456789");
  std::vector<std::uint8_t> bytes(4);
  try {
    source->read("file", 8, bytes);
    FAIL();
  } catch (const CorruptSet& error) {
    EXPECT_EQ(error.offset(), 10u);
    EXPECT_EQ(error.file(), folder / "file");
  }
}

}  // namespace
}  // namespace filiform
