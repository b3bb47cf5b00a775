#include "index/file/tile_source.h"

#include "index/errors.h"
#include "tests/support/temp_folder.h"

#include <atomic>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

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

namespace fs = std::filesystem;

// Number of this process's open files in the folder.
std::size_t openIn(const std::string& folder) {
  std::size_t count = 0;
  for (const auto& entry : fs::directory_iterator("/proc/self/fd")) {
    std::error_code ignored;
    count += fs::read_symlink(entry.path(), ignored).string().starts_with(folder + "/");
  }
  return count;
}

class ManyFiles : public ::testing::Test {
 protected:
  static constexpr int kFiles = 40;
  ManyFiles() {
    fs::create_directory(folder_ / "r");
    for (int i = 0; i < kFiles; ++i) test::writeBytes(folder_ / name(i), "the file " + std::to_string(100 + i));
  }
  static std::string name(int i) { return "r/f" + std::to_string(i); }
  static std::string readOf(const TileSource& source, int i) {
    std::vector<std::uint8_t> bytes(3);
    source.read(name(i), 9, bytes);
    return {bytes.begin(), bytes.end()};
  }
  test::TempFolder folder_;
};

TEST_F(ManyFiles, NoMoreThanTheBoundStayOpenTheOnesUsedLast) {
  const auto source = openFolder(folder_.path(), 5);
  for (int round = 0; round < 2; ++round)
    for (int i = 0; i < kFiles; ++i) {
      EXPECT_EQ(source->size(name(i)), 12u);
      EXPECT_EQ(readOf(*source, i), std::to_string(100 + i));
      EXPECT_EQ(readOf(*source, 0), "100");
      EXPECT_LE(openIn(folder_.path()), 6u) << "five files and their folder";
    }
  // An open file stays readable after its removal, so the first file was not closed.
  fs::remove(folder_ / name(0));
  EXPECT_EQ(readOf(*source, 0), "100");
}

TEST_F(ManyFiles, AClosedFileThatWasReplacedOrRemovedIsAnError) {
  const auto source = openFolder(folder_.path(), 2);
  for (int i = 0; i < kFiles; ++i) source->size(name(i));
  fs::remove(folder_ / name(1));
  test::writeBytes(folder_ / "new", "the file 102");
  fs::rename(folder_ / "new", folder_ / name(2));
  for (int i : {1, 2}) try {
      readOf(*source, i);
      ADD_FAILURE() << i;
    } catch (const IoError& error) {
      EXPECT_NE(std::string(error.what()).find(name(i) + ": was replaced or removed since the set was opened"),
                std::string::npos)
          << error.what();
    }
  EXPECT_EQ(readOf(*source, 3), "103");
  // The folder is held open: another folder of the same name changes nothing.
  fs::rename(folder_ / "r", folder_ / "old");
  fs::create_directory(folder_ / "r");
  EXPECT_EQ(readOf(*source, 4), "104");
}

TEST_F(ManyFiles, ThreadsReadMoreFilesThanStayOpen) {
  const auto source = openFolder(folder_.path(), 3);
  std::atomic<int> wrong{0};
  std::vector<std::thread> threads;
  for (int t = 0; t < 6; ++t)
    threads.emplace_back([&, t] {
      for (int k = 0; k < 500; ++k) {
        const int i = (k * (2 * t + 1) + t) % kFiles;
        wrong += readOf(*source, i) != std::to_string(100 + i);
      }
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong, 0);
  source->size(name(0));
  EXPECT_LE(openIn(folder_.path()), 4u);
}

}  // namespace
}  // namespace filiform
