// Old revisions in an object store: what stays, what goes, and a push beside. The store is http_server.py --store,
// which checks signatures; tests/groups/cluster/run has a real one.
#include "index/stores/set_tidy.h"

#include "index/errors.h"
#include "index/ingest/growth.h"
#include "index/set/tile_set.h"
#include "index/stores/set_copy.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/servers/http_server.h"
#include "tests/support/temp_folder.h"
#include "tests/support/variable.h"

#include <chrono>
#include <filesystem>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

namespace fs = std::filesystem;
using Kept = StoredRevision::Kept;
using test::TempFolder;
using test::Variable;

constexpr const char* kPlace = "s3://bucket/lab/a.fil";

class SetTidy : public ::testing::Test {
 protected:
  SetTidy() { fs::create_directories(stored_); }

  std::string make(unsigned seed) const {
    CellList stream(test::randomColumn(seed, 3, 100, 300));
    const std::string set = folder_ / ("set" + std::to_string(seed) + ".fil");
    ingest(stream, set, {.capacity = 50, .page_tiles = 4});
    return set;
  }
  CopyResult push(const std::string& set, const CopyOptions& more = {}) const {
    CopyOptions options = more;
    options.remote = quick();
    return pushSet(set, kPlace, options);
  }
  static RemoteOptions quick() { return {.deadline_s = 2, .stall_s = 1}; }
  TidyResult tidy(bool remove = true, double days = 7) const {
    return tidySet(kPlace, {.remote = quick(), .older_than_days = days, .remove = remove});
  }
  // The state of a revision; throws if it is not there.
  static StoredRevision of(const TidyResult& result, const std::string& name) {
    for (const StoredRevision& one : result.revisions)
      if (one.name == name) return one;
    throw std::runtime_error("no revision " + name);
  }
  void age(const std::string& path, int days) const {
    const auto then = fs::file_time_type::clock::now() - std::chrono::hours(24 * days);
    if (fs::is_regular_file(stored_ + "/" + path)) return fs::last_write_time(stored_ + "/" + path, then);
    for (const auto& entry : fs::recursive_directory_iterator(stored_ + "/" + path))
      if (entry.is_regular_file()) fs::last_write_time(entry.path(), then);
  }
  std::size_t filesIn(const std::string& path) const {
    std::size_t files = 0;
    if (!fs::exists(stored_ + "/" + path)) return 0;
    for (const auto& entry : fs::recursive_directory_iterator(stored_ + "/" + path)) files += entry.is_regular_file();
    return files;
  }
  void expectReadable(const std::string& revision) const {
    const auto set = TileSet::open(kPlace, quick());
    EXPECT_EQ(set->revision(), revision);
    for (const SetFile& file : set->files()) set->checkFile(file);
  }

  const TempFolder folder_;
  const std::string root_ = folder_ / "store", stored_ = root_ + "/bucket/lab/a.fil";
  const test::HttpServer server_{root_, {"--store", "secret"}};
  const Variable endpoint_{"AWS_ENDPOINT_URL", server_.url()}, key_{"AWS_ACCESS_KEY_ID", "KEY"},
      secret_{"AWS_SECRET_ACCESS_KEY", "secret"}, home_{"HOME", folder_.path()}, session_{"AWS_SESSION_TOKEN", {}};
};

TEST_F(SetTidy, RemovesWhatIsOldAndOutOfUse) {
  const std::string first = push(make(1)).revision, second = push(make(2)).revision, third = push(make(3)).revision;
  test::writeBytes(stored_ + "/notes.txt", "mine");
  fs::create_directories(stored_ + "/r-other");
  test::writeBytes(stored_ + "/r-other/notes.txt", "mine");
  for (const char* const path : {"notes.txt", "r-other"}) age(path, 100);
  for (const std::string& revision : {first, third}) age(revision, 8);
  age(second, 2);
  const std::size_t files = filesIn("");
  const TidyResult listed = tidy(false);
  EXPECT_EQ(listed.revisions.size(), 3u);
  EXPECT_EQ(of(listed, first).kept, Kept::no);
  EXPECT_EQ(of(listed, first).objects, filesIn(first));
  EXPECT_NEAR(of(listed, first).age_s, 8 * 86'400, 600);
  EXPECT_GT(of(listed, first).bytes, 1000u);
  EXPECT_EQ(of(listed, second).kept, Kept::young);
  EXPECT_EQ(of(listed, third).kept, Kept::current);
  EXPECT_EQ(listed.removed, 0u);
  EXPECT_EQ(filesIn(""), files) << "a list changes nothing";
  const std::size_t goes = filesIn(first);
  EXPECT_EQ(tidy().removed, goes);
  EXPECT_EQ(filesIn(first), 0u);
  EXPECT_EQ(filesIn(""), files - goes);
  expectReadable(third);
  EXPECT_EQ(tidy().removed, 0u);
  EXPECT_EQ(of(tidy(false, 1), second).kept, Kept::no);
}

TEST_F(SetTidy, AnUploadThatHasNotEndedCounts) {
  const std::string first = push(make(1)).revision, second = push(make(2)).revision;
  const std::string upload = first + "/tiles-00009.pack.upload";
  test::writeBytes(stored_ + "/" + upload, "part");
  age(first, 30);
  age(upload, 1);
  EXPECT_EQ(of(tidy(), first).kept, Kept::young) << "a push may go on";
  age(upload, 9);
  EXPECT_EQ(of(tidy(false), first).uploads, 1u);
  tidy();
  EXPECT_EQ(filesIn(first), 0u);
  expectReadable(second);
}

TEST_F(SetTidy, WhatARevisionUsesStays) {
  const std::string set = make(1);
  const std::string first = push(set).revision;
  std::vector<Cell> cells = test::randomColumn(4, 1, 50, 100);
  for (Cell& cell : cells) cell.name = "more", cell.source = "more";
  CellList more(std::move(cells));
  addCells(more, set);
  const std::string grown = push(set).revision;
  age("", 30);
  EXPECT_EQ(of(tidy(), first).kept, Kept::used);
  expectReadable(grown);
  // The same if the revision that uses them is not the current one, but that of a push that runs.
  push(make(2));
  age("", 30);
  age(grown, 1);
  EXPECT_EQ(of(tidy(), first).kept, Kept::used);
  EXPECT_EQ(of(tidy(), grown).kept, Kept::young);
}

TEST_F(SetTidy, APushThatSendsNothingIsSeen) {
  const std::string set = make(1);
  const std::string first = push(set).revision;
  push(make(2));
  age(first, 30);
  CopyOptions beside;
  int looks = 0;
  beside.progress = [&](std::uint64_t, std::uint64_t) {  // the first call is after the manifest
    ++looks;
    EXPECT_EQ(of(tidy(), first).kept, Kept::young);
  };
  EXPECT_EQ(push(set, beside).copied, 1u) << "the manifest";
  EXPECT_GT(looks, 0);
  expectReadable(first);
}

TEST_F(SetTidy, APushDoesNotUseWhatIsBeingRemoved) {
  const std::string set = make(1);
  const std::string first = push(set).revision;
  push(make(2));
  age(first, 30);
  TidyOptions options{.remote = quick(), .remove = true};
  int tries = 0;
  options.progress = [&](std::uint64_t, std::uint64_t) {
    if (tries++ > 0) return;
    try {
      push(set);
      ADD_FAILURE() << "pushed a revision that is being removed";
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find("filiform tidy"), std::string::npos) << error.what();
    }
    throw Interrupted("interrupted");
  };
  EXPECT_THROW(tidySet(kPlace, options), Interrupted);
  EXPECT_THROW(push(set), InputError);
  EXPECT_EQ(tries, 1);
  // The tries have sent the manifest again, so the rest is young now: it stays, without the mark.
  EXPECT_EQ(of(tidy(), first).kept, Kept::young);
  EXPECT_EQ(push(set).revision, first);
  expectReadable(first);
}

TEST_F(SetTidy, SaysWhatTheKeysMayNot) {
  const std::string first = push(make(1)).revision;
  push(make(2));
  age(first, 30);
  test::HttpServer& store = const_cast<test::HttpServer&>(server_);
  store.fault("status", first + "/directory.bin", 100, {{"status", 403}});
  try {
    tidy();
    FAIL();
  } catch (const IoError& error) {
    EXPECT_NE(std::string(error.what()).find("s3:DeleteObject"), std::string::npos) << error.what();
  }
  store.clear();
  tidy();
  EXPECT_EQ(filesIn(first), 0u);
  const Variable wrong("AWS_SECRET_ACCESS_KEY", "other");
  EXPECT_THROW(tidy(false), IoError) << "the store checks the signature";
}

TEST_F(SetTidy, RefusesWhatIsNoSetInAStore) {
  EXPECT_THROW(tidy(), InputError) << "no CURRENT";
  EXPECT_THROW(tidySet(folder_ / "a.fil"), UsageError);
  EXPECT_THROW(tidySet(server_ / "a.fil"), UsageError);
  push(make(1));
  EXPECT_THROW(tidy(false, 0.9), UsageError);
  EXPECT_THROW(tidy(false, std::numeric_limits<double>::quiet_NaN()), UsageError);
  test::writeBytes(stored_ + "/CURRENT", "r-00\n");
  EXPECT_THROW(tidy(), Error) << "CURRENT names what is not there";
}

}  // namespace
}  // namespace filiform
