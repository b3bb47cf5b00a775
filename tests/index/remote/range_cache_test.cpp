#include "index/remote/internal/range_cache.h"

#include "index/errors.h"
#include "index/file/internal/bytes.h"
#include "index/file/internal/digest.h"
#include "tests/support/sanitized.h"
#include "tests/support/temp_folder.h"

#include <csignal>
#include <filesystem>
#include <sys/wait.h>
#include <unistd.h>

#include <gtest/gtest.h>

namespace filiform {
namespace {

namespace fs = std::filesystem;
using internal::Bytes;
using internal::RangeCache;

Bytes seededBytes(std::uint64_t seed, std::size_t size) {
  Bytes bytes(size);
  for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::uint8_t>(seed * 31 + i * 7 + (i >> 8));
  return bytes;
}

std::string keyOf(std::uint64_t i) { return "http://host/a.fil/r-0/tiles-00000.pack@" + std::to_string(i); }

std::vector<fs::path> filesBelow(const std::string& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file() && entry.path().filename() != "lock") files.push_back(entry.path());
  return files;
}

std::uint64_t bytesBelow(const std::string& folder) {
  std::uint64_t sum = 0;
  for (const fs::path& file : filesBelow(folder)) sum += fs::file_size(file);
  return sum;
}

TEST(RangeCache, GivesBackWhatItWasGivenAlsoToOthers) {
  const test::TempFolder folder;
  RangeCache cache(folder / "a/b", 1 << 20), same(folder / "a/b/", 1 << 20);
  for (std::uint64_t i = 0; i < 20; ++i) cache.put(keyOf(i), seededBytes(i, 100 + i));
  for (std::uint64_t i = 0; i < 20; ++i) {
    Bytes bytes(100 + i);
    EXPECT_TRUE(same.get(keyOf(i), bytes));
    EXPECT_EQ(bytes, seededBytes(i, 100 + i));
  }
  Bytes longer(101);
  EXPECT_FALSE(cache.get(keyOf(0), longer)) << "another size";
  EXPECT_FALSE(cache.get(keyOf(20), longer));
  cache.remove(keyOf(1));
  EXPECT_FALSE(same.get(keyOf(1), longer));
}

TEST(RangeCache, GivesNoDamagedBytesAndRemovesThem) {
  const test::TempFolder folder;
  RangeCache cache(folder.path(), 1 << 20);
  const Bytes part = seededBytes(3, 200);
  cache.put(keyOf(0), part);
  ASSERT_EQ(filesBelow(folder.path()).size(), 1u);
  const std::string file = filesBelow(folder.path()).front().string(), good = test::readBytes(file);
  for (std::size_t at = 0; at < good.size(); ++at) {
    std::string bad = good;
    bad[at] = static_cast<char>(bad[at] ^ 4);
    test::writeBytes(file, bad);
    Bytes bytes(200);
    EXPECT_FALSE(cache.get(keyOf(0), bytes)) << at;
    EXPECT_FALSE(fs::exists(file)) << at;
  }
  for (const std::size_t size : {std::size_t{0}, std::size_t{31}, good.size() - 1}) {
    test::writeBytes(file, good.substr(0, size));
    Bytes bytes(200);
    EXPECT_FALSE(cache.get(keyOf(0), bytes)) << size;
  }
  // Another key with the same checksum: the file holds the key.
  test::writeBytes(file, good);
  const std::string name = internal::hex16(internal::checksum(keyOf(1)));
  fs::create_directories(folder / ("parts-1/" + name.substr(0, 2)));
  fs::copy_file(file, folder / ("parts-1/" + name.substr(0, 2) + "/" + name.substr(2)));
  Bytes bytes(200);
  EXPECT_FALSE(cache.get(keyOf(1), bytes));
  EXPECT_TRUE(cache.get(keyOf(0), bytes));
}

TEST(RangeCache, RemovesTheLeastRecentlyUsed) {
  const test::TempFolder folder;
  RangeCache cache(folder.path(), 64 << 10);
  for (std::uint64_t i = 0; i < 40; ++i) cache.put(keyOf(i), seededBytes(i, 1000));
  const auto hour = std::chrono::hours(1);
  for (const fs::path& file : filesBelow(folder.path())) fs::last_write_time(file, fs::last_write_time(file) - hour);
  Bytes bytes(1000);
  for (std::uint64_t i = 0; i < 5; ++i) EXPECT_TRUE(cache.get(keyOf(i), bytes));
  for (std::uint64_t i = 40; i < 200; ++i) {
    cache.put(keyOf(i), seededBytes(i, 1000));
    EXPECT_LE(bytesBelow(folder.path()), 64u << 10);
    for (std::uint64_t used = 0; used < 5; ++used) EXPECT_TRUE(cache.get(keyOf(used), bytes)) << i;
  }
  int left = 0;
  for (std::uint64_t i = 5; i < 40; ++i) left += cache.get(keyOf(i), bytes) ? 1 : 0;
  EXPECT_EQ(left, 0);
  cache.put(keyOf(1000), seededBytes(0, 16 << 10));  // too large a part of the whole
  Bytes large(16 << 10);
  EXPECT_FALSE(cache.get(keyOf(1000), large));
}

TEST(RangeCache, LeavesOtherFilesAlone) {
  const test::TempFolder folder;
  RangeCache cache(folder.path(), 4 << 10);
  fs::create_directories(folder / "parts-1/ab");
  fs::create_directories(folder / "parts-1/holiday");
  const auto mine = {"mine.txt",
                     "parts-1/mine.txt",
                     "parts-1/ab/mine.txt",
                     "parts-1/ab/aside-new",
                     "parts-1/ab/aside-1-2.jpg",
                     "parts-1/holiday/aside-1-2",
                     "parts-1/holiday/20240101123456"};
  for (const char* name : mine) {
    test::writeBytes(folder / name, std::string(8000, 'x'));
    fs::last_write_time(folder / name, fs::file_time_type::clock::now() - std::chrono::hours(2));
  }
  test::writeBytes(folder / "parts-1/ab/aside-1-2", "left behind");
  fs::last_write_time(folder / "parts-1/ab/aside-1-2", fs::file_time_type::clock::now() - std::chrono::hours(2));
  cache.trim();
  for (const char* name : mine) EXPECT_TRUE(fs::exists(folder / name)) << name;
  EXPECT_FALSE(fs::exists(folder / "parts-1/ab/aside-1-2"));
}

TEST(RangeCache, SaysThatItsFolderCannotBeUsed) {
  const test::TempFolder folder;
  test::writeBytes(folder / "file", "x");
  EXPECT_THROW(RangeCache(folder / "file", 1 << 20), IoError);
  EXPECT_THROW(RangeCache(folder / "file/below", 1 << 20), IoError);
}

TEST(RangeCache, IsWholeAfterKills) {
  const test::TempFolder folder;
  const int kills = test::kSanitized ? 5 : 30;
  for (int kill = 0; kill < kills; ++kill) {
    const pid_t child = ::fork();
    if (child == 0) {
      try {
        RangeCache cache(folder.path(), 256 << 10);
        for (std::uint64_t i = 0;; ++i) cache.put(keyOf(i % 300), seededBytes(i % 300, 2000));
      } catch (...) {
        ::_exit(1);
      }
    }
    ::usleep(static_cast<useconds_t>(2000 + 1500 * kill));
    ::kill(child, SIGKILL);
    ASSERT_EQ(::waitpid(child, nullptr, 0), child);
    RangeCache cache(folder.path(), 256 << 10);
    Bytes bytes(2000);
    for (std::uint64_t i = 0; i < 300; ++i)
      if (cache.get(keyOf(i), bytes)) {
        EXPECT_EQ(bytes, seededBytes(i, 2000));
      }
  }
  // Half-written files only have names of their own.
  for (const fs::path& file : filesBelow(folder.path()))
    if (!file.filename().string().starts_with("aside-")) {
      EXPECT_GT(fs::file_size(file), 2000u);
    }
}

}  // namespace
}  // namespace filiform
