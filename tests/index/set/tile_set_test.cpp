#include "index/set/tile_set.h"

#include "index/build/ingest.h"
#include "index/errors.h"
#include "index/set/internal/manifest.h"
#include "index/set/verify.h"
#include "tests/support/random_cells.h"
#include "tests/support/temp_folder.h"

#include <filesystem>
#include <thread>

#include <gtest/gtest.h>

namespace filiform {
namespace {

namespace fs = std::filesystem;

std::string ingested(const test::TempFolder& folder, std::vector<Cell> cells, std::uint32_t capacity = 50) {
  CellList stream(std::move(cells));
  ingest(stream, folder / "a.fil", {.capacity = capacity});
  return folder / "a.fil";
}

TEST(TileSet, SaysThatThereIsNone) {
  const test::TempFolder folder;
  EXPECT_THROW(TileSet::open(folder / "none.fil"), IoError);
  test::writeBytes(folder / "x.edges", "a b\n");
  for (const std::string& path : {folder.path(), folder / "x.edges"}) {
    try {
      TileSet::open(path);
      FAIL();
    } catch (const IoError& error) {
      EXPECT_NE(std::string(error.what()).find("filiform ingest"), std::string::npos) << error.what();
    }
  }
}

TEST(TileSet, RefusesWhatCurrentCannotName) {
  const test::TempFolder folder;
  const std::string path = ingested(folder, {test::randomNeuron(1)});
  const std::string good = test::readBytes(path + "/CURRENT");
  for (const std::string& bad : {std::string(), std::string("\n"), good + "\n", std::string("../../etc/passwd/xx\n"),
                                 good.substr(0, 18), std::string(19, '\0'), std::string("r-0123456789ABCDEF\n")}) {
    test::writeBytes(path + "/CURRENT", bad);
    EXPECT_THROW(TileSet::open(path), CorruptSet) << bad;
  }
  test::writeBytes(path + "/CURRENT", "r-0123456789abcdef\n");
  EXPECT_THROW(TileSet::open(path), IoError);
}

TEST(TileSet, FindsCellsByName) {
  const test::TempFolder folder;
  const std::vector<Cell> cells = test::randomColumn(51, 40, 20, 100);
  const auto set = TileSet::open(ingested(folder, cells));
  for (std::uint32_t c = 0; c < 40; ++c) EXPECT_EQ(set->findCell(set->cell(c).name), c);
  EXPECT_FALSE(set->findCell(""));
  EXPECT_FALSE(set->findCell("nobody"));
  EXPECT_FALSE(set->findCell(set->cell(39).name + "x"));
}

// More than three pages of the directory.
class PagedSet : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<test::TempFolder>();
    path_ = ingested(*folder_, test::randomColumn(7, 40, 500, 400), 2);
  }
  static void TearDownTestSuite() { folder_.reset(); }

  // A folder that counts the reads of the directory.
  class Metered final : public TileSource {
   public:
    Metered(const std::string& path, std::uint64_t& bytes, std::string file = "directory.bin")
        : source_(openFolder(path)), bytes_(bytes), file_(std::move(file)) {}
    std::uint64_t size(const std::string& name) const override { return source_->size(name); }
    std::string describe(const std::string& name) const override { return source_->describe(name); }
    void read(const std::string& name, std::uint64_t offset, std::span<std::uint8_t> bytes) const override {
      if (name.ends_with(file_)) bytes_ += bytes.size();
      source_->read(name, offset, bytes);
    }

   private:
    std::unique_ptr<TileSource> source_;
    std::uint64_t& bytes_;
    std::string file_;
  };
  static std::string directoryFile() {
    const std::string current = test::readBytes(path_ + "/CURRENT");
    return path_ + "/" + current.substr(0, 18) + "/directory.bin";
  }

  static constexpr TileId kPage = 4096;
  static std::unique_ptr<test::TempFolder> folder_;
  static std::string path_;
};
std::unique_ptr<test::TempFolder> PagedSet::folder_;
std::string PagedSet::path_;

TEST_F(PagedSet, ReadsAPageOfTheDirectoryWhenItIsNeeded) {
  std::uint64_t bytes = 0;
  const auto set = TileSet::open(std::make_unique<Metered>(path_, bytes));
  ASSERT_GT(set->tile_count(), 2 * kPage);
  EXPECT_LE(bytes, 16384u);
  bytes = 0;
  set->entry(kPage);
  EXPECT_EQ(bytes, 128u * kPage);
  const GridPoint first = mortonPoint(set->entry(0).key.low);
  EXPECT_EQ(bytes, 2 * 128u * kPage);
  set->entry(1), set->entry(2 * kPage - 1), set->load(0);
  EXPECT_EQ(bytes, 2 * 128u * kPage);

  const auto fresh = TileSet::open(path_);
  EXPECT_EQ(fresh->leaves().size(), fresh->tile_count() - (fresh->long_tile() == kNoTile ? 0 : 1));
  EXPECT_EQ(fresh->leaves().home(first), kNoTile) << "its page is not known";
  EXPECT_EQ(fresh->home(first), 0u);
  EXPECT_EQ(fresh->leaves().home(first), 0u);
  EXPECT_THROW(fresh->entry(fresh->tile_count()), std::out_of_range);
}

TEST_F(PagedSet, TheDetailOfACellTakesItsRecordAlone) {
  std::uint64_t bytes = 0;
  const auto set = TileSet::open(std::make_unique<Metered>(path_, bytes, "cells.bin"));
  const auto whole = TileSet::open(path_);
  for (std::uint32_t cell = 0; cell < set->cell_count(); cell += 13) {
    whole->cell(cell);  // reads the table
    const CellDetail one = set->loadCellDetail(cell), other = whole->loadCellDetail(cell);
    EXPECT_EQ(one.tiles, other.tiles);
    EXPECT_EQ(one.sample_ids, other.sample_ids);
  }
  bytes = 0;
  set->loadCellDetail(7);
  const std::uint64_t alone = bytes;
  bytes = 0;
  set->cell(7);
  EXPECT_GT(bytes, 128u * set->cell_count());
  bytes = 0;
  set->loadCellDetail(7);
  EXPECT_EQ(alone, bytes + 128);
  EXPECT_THROW(TileSet::open(path_)->loadCellDetail(set->cell_count()), std::out_of_range);
}

TEST_F(PagedSet, ALoadedTileKnowsTheHomesOfItsNodes) {
  const auto whole = TileSet::open(path_);
  whole->checkDirectory();
  std::size_t elsewhere = 0;  // nodes whose home is in another page
  for (TileId tile = 0; tile < whole->tile_count(); tile += 61) {
    const TileId at = tile % 2 == 0 ? tile : std::min(whole->tile_count() - 1, (tile / kPage + 1) * kPage - 1);
    const auto set = TileSet::open(path_);
    const auto loaded = set->load(at);
    for (std::uint32_t node = 0; node < loaded->node_count(); ++node) {
      const TileId home = whole->leaves().home(loaded->gridPoint(node));
      ASSERT_NE(home, kNoTile);
      ASSERT_EQ(set->leaves().home(loaded->gridPoint(node)), home) << "tile " << at;
      elsewhere += home / kPage != at / kPage;
    }
  }
  EXPECT_GT(elsewhere, 0u);
}

TEST_F(PagedSet, PagesSayWhatTheyHold) {
  const auto set = TileSet::open(path_);
  EXPECT_EQ(set->page_tiles(), kPage);
  TileFloor floor;
  for (std::uint32_t page = 0; page * kPage < set->tile_count(); ++page) {
    GridBox content;
    for (TileId tile = page * kPage; tile < std::min(set->tile_count(), (page + 1) * kPage); ++tile) {
      content.extend(set->entry(tile).content);
      floor.add(set->entry(tile).decoded_bytes, tile == set->long_tile());
    }
    EXPECT_EQ(set->pageContent(page).lo, content.lo);
    EXPECT_EQ(set->pageContent(page).hi, content.hi);
  }
  EXPECT_EQ(set->floorBytes(), floor.bytes());
  EXPECT_EQ(TileSet::open(path_)->floorBytes(), floor.bytes()) << "where no page is known";
}

TEST_F(PagedSet, ADamagedPageIsFoundBeforeItIsUsed) {
  const std::string file = directoryFile(), good = test::readBytes(file);
  const std::size_t page_at = good.size() - 128 * std::size_t{TileSet::open(path_)->tile_count()} + 128 * kPage;
  const GridPoint there = mortonPoint(TileSet::open(path_)->entry(kPage + 5).key.low);
  std::string bytes = good;
  bytes[page_at + 128 * 7 + 24] ^= 1;
  test::writeBytes(file, bytes);
  const auto set = TileSet::open(path_);
  set->entry(0);
  try {
    set->entry(kPage);
    FAIL();
  } catch (const CorruptSet& error) {
    EXPECT_NE(std::string(error.what()).find("directory.bin"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("page 1"), std::string::npos) << error.what();
  }
  EXPECT_THROW(set->home(there), CorruptSet);
  EXPECT_EQ(set->leaves().home(there), kNoTile);
  EXPECT_THROW(set->load(kPage + 5), CorruptSet);
  EXPECT_THROW(set->floorBytes(), CorruptSet);
  EXPECT_THROW(set->checkDirectory(), CorruptSet);
  const VerifyReport report = verify(path_);
  EXPECT_EQ(report.problem_count, 1u);
  test::writeBytes(file, good);
  EXPECT_TRUE(verify(path_).sound());
}

// The manifests are written as a set's writer would: the folder's name is the checksum of the text.
TEST(TileSet, RefusesAManifestWhoseWholeNumbersAreNone) {
  const test::TempFolder folder;
  const std::string path = ingested(folder, {test::randomNeuron(1)});
  const std::string good = test::readBytes(path + "/CURRENT").substr(0, 18);
  const std::string text = test::readBytes(path + "/" + good + "/manifest.json");
  const auto with = [&](const std::string& key, const std::string& value) {  // replaces the first number of the key
    const std::size_t at = text.find_first_of("-0123456789", text.find('"' + key + '"'));
    std::string changed = text;
    return changed.replace(at, text.find_first_not_of("-0123456789", at) - at, value);
  };
  EXPECT_NO_THROW(internal::decodeManifest(with("capacity", "7")));
  for (const char* key : {"capacity", "quantum_exponent", "bounds_quanta", "samples", "bytes", "refused"})
    for (const char* value : {"-5e20", "1.5", "4e2", "\"7\"", "18446744073709551616"})
      EXPECT_THROW(internal::decodeManifest(with(key, value)), internal::Damage) << key << ' ' << value;
  EXPECT_THROW(internal::decodeManifest(with("capacity", "4294967303")), internal::Damage);
  EXPECT_THROW(internal::decodeManifest(with("quantum_exponent", "4294967287")), internal::Damage);
}

TEST(TileSet, DamageNamesTileFileAndOffset) {
  const test::TempFolder folder;
  const std::string path = ingested(folder, test::randomColumn(52, 3, 300, 100));
  const auto before = TileSet::open(path);
  const auto [pack, offset] = before->place(1);
  std::string bytes = test::readBytes(pack);
  bytes[offset + 3] ^= 4;
  test::writeBytes(pack, bytes);
  const auto set = TileSet::open(path);
  set->load(0);
  set->loadAppearance(1);
  try {
    set->load(1);
    FAIL();
  } catch (const CorruptTile& error) {
    EXPECT_EQ(error.tile(), 1u);
    EXPECT_EQ(error.file(), pack);
    EXPECT_EQ(error.offset(), offset);
  }
}

TEST(TileSet, ManyThreadsMayLoad) {
  const test::TempFolder folder;
  const auto set = TileSet::open(ingested(folder, test::randomColumn(53, 5, 300, 100)));
  std::vector<std::uint64_t> owned(4, 0);
  {
    std::vector<std::jthread> threads;
    for (std::size_t i = 0; i < owned.size(); ++i)
      threads.emplace_back([&, i] {
        for (TileId t = 0; t < set->tile_count(); ++t) owned[i] += set->load(t)->owned_count();
        for (std::uint32_t c = 0; c < set->cell_count(); ++c) set->loadCellDetail(c);
        set->landmarks();
      });
  }
  for (std::uint64_t n : owned) EXPECT_EQ(n, set->counts().segments + set->counts().isolated);
}

}  // namespace
}  // namespace filiform
