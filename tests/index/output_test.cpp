#include "index/output.h"

#include "index/errors.h"
#include "tests/support/temp_folder.h"

#include <csignal>
#include <fcntl.h>
#include <filesystem>
#include <ostream>
#include <string>
#include <sys/resource.h>
#include <sys/stat.h>
#include <thread>
#include <unistd.h>

#include <gtest/gtest.h>

namespace filiform {
namespace {

namespace fs = std::filesystem;
using test::readBytes;
using test::TempFolder;
using test::writeBytes;

std::size_t entriesIn(const fs::path& folder) {
  return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
}

// While it lives, no file grows beyond this size.
class FullDisk {
 public:
  explicit FullDisk(rlim_t bytes) : signal_(std::signal(SIGXFSZ, SIG_IGN)) {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit small{bytes, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &small);
  }
  ~FullDisk() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, signal_);
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;

 private:
  rlimit before_{};
  void (*signal_)(int);
};

TEST(Output, ReplacesAFileAtTheEndAndKeepsItsPermissions) {
  const TempFolder folder;
  const std::string path = folder / "a.csv";
  writeBytes(path, "old");
  fs::permissions(path, fs::perms::owner_read | fs::perms::owner_write | fs::perms::group_read);
  {
    Output out(path);
    EXPECT_TRUE(out.isFile());
    out.stream() << "new " << 1;
    out.stream().flush();
    EXPECT_EQ(readBytes(path), "old");
    out.finish();
    out.finish();
  }
  EXPECT_EQ(readBytes(path), "new 1");
  EXPECT_EQ(fs::status(path).permissions(), fs::perms::owner_read | fs::perms::owner_write | fs::perms::group_read);
  EXPECT_EQ(entriesIn(folder.path()), 1u);
}

TEST(Output, LeavesTheOldFileAndNothingElseWhenTheWorkFails) {
  const TempFolder folder;
  writeBytes(folder / "old", "old");
  writeBytes(folder / "old.partial", "another's");
  for (const bool by_name : {false, true}) {
    for (const char* name : {"old", "none"}) {
      Output out(folder / name, {.by_name = by_name});
      if (by_name)
        writeBytes(out.partialPath(), "half");
      else
        out.write("half");
    }
  }
  EXPECT_EQ(readBytes(folder / "old"), "old");
  EXPECT_EQ(readBytes(folder / "old.partial"), "another's");
  EXPECT_EQ(entriesIn(folder.path()), 2u);
}

TEST(Output, AnotherWriterFillsAFileOfTheSameEnding) {
  const TempFolder folder;
  writeBytes(folder / "film.mp4", "old");
  fs::permissions(folder / "film.mp4", fs::perms::owner_read | fs::perms::owner_write);
  Output out(folder / "film.mp4", {.by_name = true});
  EXPECT_TRUE(out.partialPath().ends_with(".mp4"));
  fs::remove(out.partialPath());  // like a writer that also renames
  writeBytes(out.partialPath(), "new");
  out.finish();
  EXPECT_EQ(readBytes(folder / "film.mp4"), "new");
  EXPECT_EQ(fs::status(folder / "film.mp4").permissions(), fs::perms::owner_read | fs::perms::owner_write);
  EXPECT_EQ(entriesIn(folder.path()), 1u);
}

TEST(Output, FollowsLinksAndKeepsThem) {
  const TempFolder folder;
  fs::create_directory(folder / "deep");
  writeBytes(folder / "deep/file", "old");
  fs::create_symlink("deep/middle", folder / "link");
  fs::create_symlink("file", folder / "deep/middle");
  fs::create_symlink("deep/new", folder / "dangling");
  for (const char* name : {"link", "dangling"}) {
    Output out(folder / name);
    out.write("new");
    out.finish();
  }
  EXPECT_EQ(fs::read_symlink(folder / "link"), "deep/middle");
  EXPECT_EQ(fs::read_symlink(folder / "dangling"), "deep/new");
  EXPECT_EQ(readBytes(folder / "deep/file"), "new");
  EXPECT_EQ(readBytes(folder / "deep/new"), "new");
  EXPECT_EQ(entriesIn(folder / "deep"), 3u);

  fs::create_symlink("loop", folder / "loop");
  EXPECT_THROW(Output(folder / "loop"), IoError);
}

TEST(Output, WritesThroughDevicesAndPipes) {
  const TempFolder folder;
  fs::create_symlink("/dev/null", folder / "null");
  for (const bool by_name : {false, true}) {
    Output out(folder / "null", {.by_name = by_name});
    EXPECT_FALSE(out.isFile());
    if (by_name)
      writeBytes(out.partialPath(), "x");
    else
      out.write("x");
    out.finish();
    EXPECT_TRUE(fs::is_symlink(folder / "null"));
    EXPECT_TRUE(fs::is_character_file("/dev/null"));
  }
  Output full("/dev/full");
  full.write("x");
  EXPECT_THROW(full.finish(), IoError);

  ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
  std::string read;
  std::thread reader([&] { read = readBytes(folder / "pipe"); });
  {
    Output out(folder / "pipe");
    EXPECT_FALSE(out.isFile());
    out.write("through");
    out.finish();
  }
  reader.join();
  EXPECT_EQ(read, "through");
  EXPECT_TRUE(fs::is_fifo(folder / "pipe"));
}

TEST(Output, ToldToStopItWaitsForNoReader) {
  const TempFolder folder;
  ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
  const std::atomic<bool> cancel{true};
  EXPECT_THROW(Output(folder / "pipe", {.cancel = &cancel}), Interrupted);
}

TEST(Output, APipeWhoseReaderHasGoneIsNoFullDisk) {
  std::signal(SIGPIPE, SIG_IGN);
  int ends[2];
  ASSERT_EQ(::pipe(ends), 0);
  ::close(ends[0]);
  Output out("/dev/fd/" + std::to_string(ends[1]));
  EXPECT_THROW(
      {
        out.write(std::string(1 << 20, 'x'));
        out.finish();
      },
      ClosedPipe);
  ::close(ends[1]);
}

TEST(Output, AnOpenDescriptorIsWrittenAtItsPlace) {
  const TempFolder folder;
  const std::string path = folder / "file";
  const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
  ASSERT_EQ(::write(file, "first ", 6), 6);
  Output out("/proc/self/fd/" + std::to_string(file));
  out.write("second");
  out.finish();
  ASSERT_EQ(::write(file, " third", 6), 6);
  ::close(file);
  EXPECT_EQ(readBytes(path), "first second third");
  EXPECT_EQ(entriesIn(folder.path()), 1u);
}

TEST(Output, WorkThatDidNotEndIsKeptBesideAnOlderFile) {
  const TempFolder folder;
  const std::string path = folder / "a.rec";
  for (const char* expected : {"a.rec", "a.unfinished.rec", "a.unfinished-2.rec"}) {
    Output out(path);
    out.write(expected);
    EXPECT_EQ(fs::path(out.finishAside()).filename(), expected);
    EXPECT_EQ(readBytes(folder / expected), expected);
  }
  EXPECT_EQ(entriesIn(folder.path()), 3u);
}

TEST(Output, WhatAFullDiskCutIsMendedBesideAnOlderFile) {
  const TempFolder folder;
  const std::string path = folder / "a.csv";
  writeBytes(path, "old");
  const FullDisk full(100);
  for (const char* expected : {"a.unfinished.csv", "a.unfinished-2.csv"}) {
    Output out(path, {.mend = cutToWholeLines});
    const auto write = [&out] {
      for (int i = 0; i < 1000; ++i) out.stream() << "row " << i << '\n' << std::flush;
    };
    EXPECT_THROW(write(), IoError);
    EXPECT_EQ(fs::path(out.finishAside()).filename(), expected);
    const std::string kept = readBytes(folder / expected);
    EXPECT_TRUE(kept.starts_with("row 0\nrow 1\n") && kept.ends_with('\n') && kept.size() > 90) << kept;
  }
  EXPECT_EQ(readBytes(path), "old");
  Output out(path);
  EXPECT_THROW(out.write(std::string(100'000, 'x')), IoError);
  EXPECT_THROW(out.finishAside(), IoError) << "nothing mends it";
}

TEST(Output, RefusesFoldersAndFilesThatMayNotBeWritten) {
  const TempFolder folder;
  EXPECT_THROW(Output(""), UsageError);
  EXPECT_THROW(Output(folder.path()), IoError);
  EXPECT_THROW(Output(folder / "no/such/file"), IoError);
  if (::geteuid() == 0) GTEST_SKIP() << "root may write anything";
  writeBytes(folder / "fixed", "old");
  fs::permissions(folder / "fixed", fs::perms::owner_read);
  EXPECT_THROW(Output(folder / "fixed"), IoError);
}

}  // namespace
}  // namespace filiform
