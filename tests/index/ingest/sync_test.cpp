#include "index/attributes/cell_attributes.h"
#include "index/circuits/attribute_table.h"
#include "index/errors.h"
#include "index/ingest/growth.h"
#include "index/ingest/input_provenance.h"
#include "index/input/input.h"
#include "index/verify/verify.h"
#include "tests/support/temp_folder.h"
#include "tests/support/zip_builder.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

namespace fs = std::filesystem;
using test::writeBytes;

class Sync : public ::testing::Test {
 protected:
  void SetUp() override { fs::create_directories(lab_ + "/sub"); }

  // A cell of a soma and a zigzag.
  void write(const std::string& name, int samples, int y) const {
    std::string text = "1 1 0 " + std::to_string(y) + " 0 2 -1\n";
    for (int i = 2; i <= samples; ++i)
      text += std::to_string(i) + " 3 " + std::to_string(3 * i) + " " + std::to_string(y) + " " +
              std::to_string(i % 4) + " 0.5 " + std::to_string(i - 1) + "\n";
    writeBytes(lab_ + "/" + name, text);
  }
  IngestResult make(const std::string& path, const std::string& table = "") const {
    Input input({lab_});
    const IngestOptions options{
        .capacity = 40, .levels = true, .provenance = [&] { return provenanceOf(input.reports()); }};
    if (table.empty()) return ingest(input, path, options);
    const AttributeTable attributes = AttributeTable::parse(table, "t.csv", "cell");
    AttributedCells cells(input, attributes);
    return ingest(cells, path, options);
  }
  SyncResult sync(bool remove, const std::string& table = "", double unit_um = 1) {
    InputOptions reading;
    reading.swc.unit_um = unit_um;
    Input input({lab_}, reading);
    const IngestOptions options{.provenance = [&] { return provenanceOf(input.reports()); }};
    const SyncOptions how{remove, [&](const std::map<std::string, SyncFate>& fates) { fates_ = fates; }};
    if (table.empty()) return syncCells(input, set_, how, options);
    const AttributeTable attributes = AttributeTable::parse(table, "t.csv", "cell");
    AttributedCells cells(input, attributes);
    return syncCells(cells, set_, how, options);
  }
  std::string fate(const std::string& source) const {
    return fates_.contains(source) ? std::string(name(fates_.at(source))) : "none";
  }
  // After compact: the revision that one ingest of the folder makes.
  void expectAsOneIngest(const std::string& table = "") const {
    const VerifyReport report = verify(set_, {.deep = true});
    EXPECT_TRUE(report.sound()) << report.problems.front();
    compactSet(set_);
    fs::remove_all(folder_ / "again.fil");
    EXPECT_EQ(TileSet::open(set_)->revision(), make(folder_ / "again.fil", table).revision);
  }
  std::vector<std::string> names() const {
    const auto set = TileSet::open(set_);
    std::vector<std::string> names;
    for (std::uint32_t c = 0; c < set->cell_count(); ++c)
      if (!set->cell(c).removed) names.push_back(set->cell(c).name);
    std::sort(names.begin(), names.end());
    return names;
  }

  test::TempFolder folder_;
  std::string lab_ = folder_ / "lab", set_ = folder_ / "s.fil";
  std::map<std::string, SyncFate> fates_;
};

TEST_F(Sync, AFolderThatGrewChangedAndLostFiles) {
  for (int i = 0; i < 9; ++i) write("c" + std::to_string(i) + ".swc", 120, 10 * i);
  make(set_);
  write("new.swc", 70, 5);
  write("c3.swc", 50, 31);
  fs::remove(lab_ + "/c6.swc");
  const SyncResult result = sync(true);
  EXPECT_EQ(result.counts.added, 1u);
  EXPECT_EQ(result.counts.changed, 1u);
  EXPECT_EQ(result.counts.equal, 7u);
  EXPECT_EQ(result.counts.removed, 1u);
  EXPECT_EQ(result.counts.gone + result.counts.held + result.counts.renamed, 0u);
  EXPECT_FALSE(result.compacted);
  EXPECT_EQ(fate("new.swc") + fate("c3.swc") + fate("c0.swc") + fate("c6.swc"), "newchangedequalremoved");
  EXPECT_EQ(names(), (std::vector<std::string>{"c0", "c1", "c2", "c3", "c4", "c5", "c7", "c8", "new"}));
  const auto set = TileSet::open(set_);
  EXPECT_EQ(set->counts().segments, 7u * 119 + 49 + 69);
  EXPECT_EQ(set->section("somata").value().size(), 8u + 9 * 36) << "none of removed cells";
  expectAsOneIngest();
}

TEST_F(Sync, ALargeChangeMakesACompactSetAtOnce) {
  for (int i = 0; i < 4; ++i) write("c" + std::to_string(i) + ".swc", 60, 10 * i);
  make(set_);
  for (int i = 1; i < 4; ++i) write("c" + std::to_string(i) + ".swc", 90, 10 * i + 2);
  const SyncResult result = sync(false);
  EXPECT_TRUE(result.compacted);
  EXPECT_EQ(result.counts.changed, 3u);
  EXPECT_EQ(TileSet::open(set_)->revision(), make(folder_ / "again.fil").revision);
}

TEST_F(Sync, NothingIsPublishedForAFolderThatIsTheSame) {
  for (int i = 0; i < 3; ++i) write("c" + std::to_string(i) + ".swc", 30, 10 * i);
  const std::string revision = make(set_).revision;
  const SyncResult result = sync(true);
  EXPECT_TRUE(result.set.unchanged);
  EXPECT_EQ(result.counts.equal, 3u);
  EXPECT_EQ(TileSet::open(set_)->revision(), revision);
}

TEST_F(Sync, WhatIsGoneStaysWithoutDelete) {
  for (int i = 0; i < 5; ++i) write("c" + std::to_string(i) + ".swc", 100, 10 * i);
  make(set_);
  fs::remove(lab_ + "/c1.swc");
  write("d.swc", 20, 3);
  const SyncResult kept = sync(false);
  EXPECT_EQ(kept.counts.gone, 1u);
  EXPECT_EQ(kept.counts.removed, 0u);
  EXPECT_EQ(fate("c1.swc"), "gone");
  EXPECT_EQ(names().size(), 6u);
  EXPECT_NE(TileSet::open(set_)->readProvenance().find("c1.swc"), std::string::npos);
  EXPECT_EQ(sync(true).counts.removed, 1u);
  EXPECT_EQ(TileSet::open(set_)->readProvenance().find("c1.swc"), std::string::npos);
  expectAsOneIngest();
}

TEST_F(Sync, ACellWhoseFileIsDamagedNowStays) {
  for (int i = 0; i < 5; ++i) write("c" + std::to_string(i) + ".swc", 100, 10 * i);
  make(set_);
  writeBytes(lab_ + "/c2.swc", "no sample at all\n");
  const SyncResult result = sync(true);
  EXPECT_EQ(result.counts.held, 1u);
  EXPECT_EQ(result.counts.removed, 0u);
  EXPECT_EQ(fate("c2.swc"), "held");
  EXPECT_EQ(names().size(), 5u);
  EXPECT_EQ(TileSet::open(set_)->refused(), 1u);
  write("c2.swc", 100, 20);
  EXPECT_EQ(sync(true).counts.equal, 5u);
  expectAsOneIngest();
}

TEST_F(Sync, CellsOfADamagedEntryStayWhateverItsName) {
  const auto pack = [&](std::optional<std::uint32_t> crc32) {
    std::vector<test::ZipMember> members;
    for (const char* const name : {"C:\\lab\\a.swc", "/b.swc", "c.swc"}) {
      members.push_back(test::zipMember(name, "1 1 0 0 0 2 -1\n2 3 9 0 0 1 1\n"));
      if (members.size() < 3) members.back().crc32 = crc32;
    }
    writeBytes(lab_ + "/z.zip", test::buildZip(members));
  };
  pack(std::nullopt);
  make(set_);
  EXPECT_EQ(names(), (std::vector<std::string>{"a", "b", "c"}));
  pack(7);
  const SyncResult result = sync(true);
  EXPECT_EQ(result.counts.held, 2u);
  EXPECT_EQ(result.counts.removed, 0u);
  EXPECT_EQ(fate("z.zip/b.swc"), "held");
  EXPECT_EQ(names().size(), 3u);
}

TEST_F(Sync, TheCellOfADamagedFileStaysBesideAnEqualSource) {
  const auto pack = [&](std::optional<std::uint32_t> crc32) {
    std::vector<test::ZipMember> members = {test::zipMember("a.swc", "1 1 0 0 0 2 -1\n2 3 9 0 0 1 1\n"),
                                            test::zipMember("a.swc", "1 1 0 0 0 2 -1\n2 3 7 0 0 1 1\n")};
    members[1].crc32 = crc32;
    writeBytes(lab_ + "/z.zip", test::buildZip(members));
  };
  pack(std::nullopt);
  make(set_);
  pack(7);
  const SyncResult result = sync(true);
  EXPECT_EQ(result.counts.equal, 1u);
  EXPECT_EQ(result.counts.held, 1u);
  EXPECT_EQ(result.counts.removed, 0u);
  EXPECT_EQ(fate("z.zip/a.swc"), "held");
  EXPECT_EQ(names(), (std::vector<std::string>{"a", "a#2"}));
}

TEST_F(Sync, CellsOfAFileThatIsPassedOverNowStay) {
  const auto neurons = [](const std::string& name) {
    return R"({"neurons": [{"idString": ")" + name +
           R"(", "axon": [{"sampleNumber": 1, "x": 1, "y": 2, "z": 3, "radius": 1, "parentNumber": -1}]}]})";
  };
  write("c.swc", 100, 0);
  writeBytes(lab_ + "/n.json", neurons("N"));
  writeBytes(lab_ + "/z.zip", test::buildZip({test::zipMember("m.json", neurons("M"))}));
  make(set_);
  writeBytes(lab_ + "/n.json", "");
  writeBytes(lab_ + "/z.zip", test::buildZip({test::zipMember("m.json", "<html>not found</html>")}));
  const SyncResult result = sync(true);
  EXPECT_EQ(result.counts.held, 2u);
  EXPECT_EQ(result.counts.removed, 0u);
  EXPECT_EQ(fate("n.json/N") + fate("z.zip/m.json/M"), "heldheld");
  EXPECT_EQ(names().size(), 3u);
}

TEST_F(Sync, DeleteIsRefusedIfAnInputIsUnreadableOrTheFolderIsEmpty) {
  for (int i = 0; i < 3; ++i) write("c" + std::to_string(i) + ".swc", 30, 10 * i);
  const std::string revision = make(set_).revision;
  fs::remove(lab_ + "/c1.swc");
  fs::create_symlink("nowhere", lab_ + "/sub/b.swc");
  try {
    sync(true);
    FAIL() << "not refused";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("sub/b.swc: cannot be read"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("--delete"), std::string::npos) << error.what();
  }
  fs::remove_all(lab_);
  EXPECT_THROW(sync(true), IoError);
  fs::create_directories(lab_);
  EXPECT_THROW(sync(true), InputError);
  EXPECT_EQ(TileSet::open(set_)->revision(), revision);
}

TEST_F(Sync, NamesAreThoseOfOneIngest) {
  for (int i = 0; i < 5; ++i) write("c" + std::to_string(i) + ".swc", 100, 10 * i);
  make(set_);
  write("sub/c0.swc", 40, 3);
  const SyncResult result = sync(false);
  EXPECT_EQ(result.counts.added, 1u);
  EXPECT_EQ(names(), (std::vector<std::string>{"c0", "c1", "c2", "c3", "c4", "sub/c0"}));
  expectAsOneIngest();
  fs::rename(lab_ + "/c0.swc", lab_ + "/moved.swc");
  EXPECT_EQ(sync(true).counts.renamed, 1u) << "sub/c0 is c0 now";
  EXPECT_EQ(names(), (std::vector<std::string>{"c0", "c1", "c2", "c3", "c4", "moved"}));
  expectAsOneIngest();
}

TEST_F(Sync, TheCellsOfAFileAreReplacedTogether) {
  for (int i = 0; i < 5; ++i) write("c" + std::to_string(i) + ".swc", 100, 10 * i);
  const std::string one = "1 1 0 0 90 2 -1\n2 3 9 0 90 1 1\n", other = "3 1 500 0 90 2 -1\n4 3 509 0 90 1 3\n";
  writeBytes(lab_ + "/two.swc", one + other);
  make(set_);
  EXPECT_EQ(names(), (std::vector<std::string>{"c0", "c1", "c2", "c3", "c4", "two/1", "two/2"}));
  EXPECT_EQ(sync(false).counts.equal, 7u);
  writeBytes(lab_ + "/two.swc", one);
  const SyncResult result = sync(false);
  EXPECT_EQ(result.counts.changed, 1u);
  EXPECT_EQ(result.counts.removed, 1u) << "the file has it no longer, although nothing is gone from the folder";
  EXPECT_EQ(names(), (std::vector<std::string>{"c0", "c1", "c2", "c3", "c4", "two"}));
  expectAsOneIngest();
}

TEST_F(Sync, TheSameBytesInAnotherUnitAreAChange) {
  for (int i = 0; i < 3; ++i) write("c" + std::to_string(i) + ".swc", 30, 10 * i);
  make(set_);
  EXPECT_EQ(sync(false, "", 0.001).counts.changed, 3u);
  EXPECT_EQ(sync(false).counts.changed, 3u);
  expectAsOneIngest();
}

TEST_F(Sync, AttributesOfATableReachAllCellsAndThoseOfChangedOnesStay) {
  for (int i = 0; i < 6; ++i) write("c" + std::to_string(i) + ".swc", 100, 10 * i);
  const std::string before = "cell,type\nc0,a\nc1,b\n", after = "cell,type\nc0,z\nc1,b\nd,n\n";
  make(set_, before);
  write("c1.swc", 80, 11);
  write("d.swc", 30, 7);
  sync(true);
  const auto value = [&](const std::string& cell) {
    const auto set = TileSet::open(set_);
    const CellAttributes attributes(*set);
    return textOf(attributes.value(attributes.find("type").value(), set->findCell(cell).value()));
  };
  EXPECT_EQ(value("c0") + value("c1") + value("d"), "ab");
  EXPECT_FALSE(sync(true, after).set.unchanged);
  EXPECT_EQ(value("c0") + value("c1") + value("d"), "zbn");
  expectAsOneIngest(after);
}

TEST_F(Sync, AnInterruptedRunLeavesTheOldSetWhole) {
  for (int i = 0; i < 6; ++i) write("c" + std::to_string(i) + ".swc", 100, 10 * i);
  const std::string revision = make(set_).revision;
  write("c1.swc", 80, 11);
  write("d.swc", 30, 7);
  for (int stop = 0;; ++stop) {
    Input input({lab_});
    int steps = 0;
    IngestOptions options{.provenance = [&] { return provenanceOf(input.reports()); }};
    options.progress = [&](const char*, std::uint64_t, std::uint64_t) {
      if (steps++ == stop) throw Interrupted("interrupted");
    };
    try {
      syncCells(input, set_, {.remove = true}, options);
      EXPECT_GT(stop, 3);
      break;
    } catch (const Interrupted&) {
      EXPECT_EQ(TileSet::open(set_)->revision(), revision);
      EXPECT_TRUE(verify(set_, {}).sound());
    }
  }
  expectAsOneIngest();
}

}  // namespace
}  // namespace filiform
