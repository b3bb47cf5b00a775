// Copies of sets from a real server. tests/groups/cluster/run pushes to a real object store.
#include "index/stores/set_copy.h"

#include "index/errors.h"
#include "index/ingest/growth.h"
#include "index/set/tile_set.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/servers/http_server.h"
#include "tests/support/temp_folder.h"

#include <atomic>
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

namespace fs = std::filesystem;
using test::HttpServer;
using test::TempFolder;

// Path and content of all files below a folder.
std::map<std::string, std::string> contentOf(const std::string& folder) {
  std::map<std::string, std::string> content;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file())
      content[fs::relative(entry.path(), folder).string()] = test::readBytes(entry.path().string());
  return content;
}

class SetCopy : public ::testing::Test {
 protected:
  SetCopy() {
    CellList stream(test::randomColumn(3, 8, 500, 400));
    ingest(stream, folder_ / "a.fil", {.capacity = 50, .page_tiles = 4, .levels = true});
  }
  CopyOptions quick(bool force = false) const { return {.remote = {.deadline_s = 2, .stall_s = 1}, .force = force}; }
  CopyResult pull(bool force = false) const { return pullSet(server_ / "a.fil", folder_ / "b.fil", quick(force)); }
  void grow() const {
    std::vector<Cell> cells = test::randomColumn(4, 1, 50, 100);
    for (Cell& cell : cells) cell.name = "more", cell.source = "more";
    CellList more(std::move(cells));
    addCells(more, folder_ / "a.fil");
  }

  const TempFolder folder_;
  mutable HttpServer server_{folder_.path()};
};

TEST_F(SetCopy, APulledSetHasTheSameBytes) {
  std::uint64_t last = 0;
  CopyOptions options = quick();
  options.progress = [&](std::uint64_t done, std::uint64_t total) {
    EXPECT_LE(last, done);
    EXPECT_LE(done, total);
    last = done;
  };
  const CopyResult first = pullSet(server_ / "a.fil", folder_ / "b.fil", options);
  EXPECT_EQ(contentOf(folder_ / "b.fil"), contentOf(folder_ / "a.fil"));
  EXPECT_EQ(first.copied, first.files);
  EXPECT_EQ(first.before, "");
  const CopyResult again = pull();
  EXPECT_EQ(again.copied, 0u);
  EXPECT_EQ(again.before, first.revision);
}

TEST_F(SetCopy, AFailedPullGoesOnWhereItStopped) {
  server_.fault("status", ".pack", 1000, {{"status", 404}});
  EXPECT_THROW(pull(), IoError);
  EXPECT_FALSE(fs::exists(folder_ / "b.fil/CURRENT"));
  EXPECT_THROW(TileSet::open(folder_ / "b.fil"), IoError);
  server_.clear();
  const CopyResult rest = pull();
  EXPECT_LT(rest.copied, rest.files);
  EXPECT_EQ(contentOf(folder_ / "b.fil"), contentOf(folder_ / "a.fil"));
}

TEST_F(SetCopy, DamageOnTheWayIsFound) {
  server_.fault("flip", ".pack", 1000);
  EXPECT_THROW(pull(), CorruptSet);
  EXPECT_FALSE(fs::exists(folder_ / "b.fil/CURRENT"));
  server_.clear();
  pull();
  EXPECT_EQ(contentOf(folder_ / "b.fil"), contentOf(folder_ / "a.fil"));
}

TEST_F(SetCopy, ADamagedFileIsReadAgain) {
  pull();
  std::uint64_t damaged = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder_ / "b.fil")) {
    if (entry.path().extension() != ".pack") continue;
    std::string bytes = test::readBytes(entry.path().string());
    bytes[bytes.size() / 2] ^= 1;
    test::writeBytes(entry.path().string(), bytes);
    ++damaged;
  }
  EXPECT_GT(damaged, 0u);
  EXPECT_EQ(pull().copied, damaged);
  EXPECT_EQ(contentOf(folder_ / "b.fil"), contentOf(folder_ / "a.fil"));
}

TEST_F(SetCopy, AGrownSetTakesItsNewFilesOnly) {
  pull();
  grow();
  EXPECT_THROW(pull(), InputError) << "another revision, without --force";
  const CopyResult grown = pull(true);
  EXPECT_GT(grown.copied, 0u);
  EXPECT_LT(grown.copied, grown.files);
  const auto copy = TileSet::open(folder_ / "b.fil");
  EXPECT_EQ(copy->revision(), TileSet::open(folder_ / "a.fil")->revision());
  for (const SetFile& file : copy->files()) EXPECT_NO_THROW(copy->checkFile(file));
}

TEST_F(SetCopy, NothingElseIsReplaced) {
  fs::create_directory(folder_ / "b.fil");
  test::writeBytes(folder_ / "b.fil/notes.txt", "mine");
  EXPECT_THROW(pull(true), InputError);
  EXPECT_EQ(contentOf(folder_ / "b.fil").size(), 1u);
  EXPECT_THROW(pullSet(server_ / "none.fil", folder_ / "c.fil", quick()), IoError);
  EXPECT_FALSE(fs::exists(folder_ / "c.fil"));
  EXPECT_THROW(pullSet(folder_ / "a.fil", folder_ / "c.fil"), UsageError);
  EXPECT_THROW(pushSet(folder_ / "a.fil", server_ / "c.fil"), UsageError);
}

TEST_F(SetCopy, AnInterruptionEndsAPull) {
  std::atomic<bool> cancel{true};
  CopyOptions options = quick();
  options.remote.cancel = &cancel;
  EXPECT_THROW(pullSet(server_ / "a.fil", folder_ / "b.fil", options), Interrupted);
  EXPECT_FALSE(fs::exists(folder_ / "b.fil/CURRENT"));
}

}  // namespace
}  // namespace filiform
