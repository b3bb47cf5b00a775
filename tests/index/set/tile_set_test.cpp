#include "index/set/tile_set.h"

#include "index/errors.h"
#include "index/ingest/ingest.h"
#include "index/query/nearest.h"
#include "index/query/tile_finder.h"
#include "index/set/internal/manifest.h"
#include "index/verify/verify.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/temp_folder.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <map>
#include <random>
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

// A folder that counts the reads of some files.
class Metered final : public TileSource {
 public:
  struct Reads {
    std::uint64_t count = 0, bytes = 0;
  };
  Metered(const std::string& path, Reads& reads, std::string files = "")
      : source_(openFolder(path)), reads_(reads), files_(std::move(files)) {}
  std::uint64_t size(const std::string& name) const override { return source_->size(name); }
  std::string describe(const std::string& name) const override { return source_->describe(name); }
  void read(const std::string& name, std::uint64_t offset, std::span<std::uint8_t> bytes) const override {
    if (name.ends_with(files_)) ++reads_.count, reads_.bytes += bytes.size();
    source_->read(name, offset, bytes);
  }

 private:
  std::unique_ptr<TileSource> source_;
  Reads& reads_;
  std::string files_;
};

// Many small pages of the directory.
class PagedSet : public ::testing::Test {
 protected:
  static constexpr TileId kPage = 4;
  static constexpr std::uint32_t kGroup = 4;  // pages of an inner page

  static void SetUpTestSuite() {
    folder_ = std::make_unique<test::TempFolder>();
    path_ = *folder_ / "a.fil";
    CellList stream(test::randomColumn(7, 8, 500, 400));
    ingest(stream, path_, {.capacity = 2, .page_tiles = kPage, .group_pages = kGroup});
  }
  static void TearDownTestSuite() { folder_.reset(); }

  static std::string directoryFile() {
    const std::string current = test::readBytes(path_ + "/CURRENT");
    return path_ + "/" + current.substr(0, 18) + "/directory.bin";
  }

  static std::unique_ptr<test::TempFolder> folder_;
  static std::string path_;
};
std::unique_ptr<test::TempFolder> PagedSet::folder_;
std::string PagedSet::path_;

TEST_F(PagedSet, TheFirstTileTakesOneReadOfTheDirectory) {
  Metered::Reads all;
  const auto set = TileSet::open(std::make_unique<Metered>(path_, all));
  EXPECT_EQ(all.count, 2u) << "CURRENT and the manifest";
  ASSERT_EQ(set->page_tiles(), kPage);
  ASSERT_EQ(set->group_pages(), kGroup);
  ASSERT_GT(set->tile_count(), 1000u);
  const TileId tile = set->tile_count() / 2;
  set->entry(tile);
  EXPECT_EQ(all.count, 3u);
  const auto again = TileSet::open(std::make_unique<Metered>(path_, all));
  all.count = 0;
  EXPECT_EQ(again->home(mortonPoint(set->entry(tile).key.low)), tile);
  EXPECT_EQ(all.count, 1u);
}

TEST_F(PagedSet, ReadsAGroupOfTheDirectoryWhenItIsNeeded) {
  Metered::Reads reads;
  const auto set = TileSet::open(std::make_unique<Metered>(path_, reads, "directory.bin"));
  EXPECT_EQ(reads.count, 0u);
  set->entry(kPage);
  EXPECT_EQ(reads.count, 1u);
  EXPECT_LT(reads.bytes, 70u * kGroup + 48u * kPage * kGroup);
  const GridPoint first = mortonPoint(set->entry(0).key.low);
  set->entry(1), set->entry(kGroup * kPage - 1), set->pageContent(1);
  EXPECT_EQ(reads.count, 1u);
  set->pageContent(kGroup);
  EXPECT_EQ(reads.count, 2u);

  const auto fresh = TileSet::open(path_);
  EXPECT_EQ(fresh->leaves().size(), fresh->tile_count() - (fresh->long_tile() == kNoTile ? 0 : 1));
  EXPECT_EQ(fresh->leaves().home(first), kNoTile) << "its page is not known";
  EXPECT_EQ(fresh->home(first), 0u);
  EXPECT_EQ(fresh->leaves().home(first), 0u);
  EXPECT_THROW(fresh->entry(fresh->tile_count()), std::out_of_range);
}

TEST(TileSet, ALargeGroupOfTheDirectoryIsReadPageByPage) {
  const test::TempFolder folder;
  CellList stream(test::randomColumn(7, 8, 500, 400));
  constexpr TileId kPage = 16;
  ingest(stream, folder / "a.fil", {.capacity = 2, .page_tiles = kPage, .group_pages = 4096});
  Metered::Reads reads;
  const auto set = TileSet::open(std::make_unique<Metered>(folder / "a.fil", reads, "directory.bin"));
  ASSERT_GT(set->tile_count(), 1000u);
  set->entry(kPage);
  EXPECT_EQ(reads.count, 2u) << "the inner page, then one of its pages";
  set->pageContent(0), set->entry(kPage + 1);
  EXPECT_EQ(reads.count, 2u);
  set->entry(0);
  EXPECT_EQ(reads.count, 3u);
  set->checkDirectory();
  EXPECT_TRUE(verify(folder / "a.fil", {.deep = true}).sound());
}

// What `filiform nearest` reads in a new process, without opening. The set has as many tiles as one of 5e6 segments.
TEST(TileSet, AFirstJumpTakesFewReads) {
  const test::TempFolder folder;
  CellList stream(test::randomColumn(91, 12, 4000, 500));
  ingest(stream, folder / "a.fil", {.capacity = 14});
  const auto whole = TileSet::open(folder / "a.fil");
  ASSERT_GT(whole->tile_count(), 3500u);
  const Nearest known(*whole, {});
  std::mt19937_64 random(92);
  const Grid grid = whole->grid();
  const Vector3d lo_W = grid.toWorld(whole->bounds().lo), size = grid.toWorld(whole->bounds().hi) - lo_W;
  Metered::Reads directory, packs;
  constexpr unsigned kJumps = 60;
  for (unsigned i = 0; i < kJumps; ++i) {
    Vector3d h_W;
    for (int axis = 0; axis < 3; ++axis)
      h_W[axis] = lo_W[axis] + size[axis] * (static_cast<double>(random() >> 11) * 0x1p-53);
    for (const auto& [reads, file] : {std::pair(&directory, "directory.bin"), std::pair(&packs, ".pack")}) {
      const auto set = TileSet::open(std::make_unique<Metered>(folder / "a.fil", *reads, file));
      const auto found = Nearest(*set, {}).find(h_W), expected = known.find(h_W);
      ASSERT_EQ(found.size(), 1u);
      EXPECT_EQ(found[0].segment, expected[0].segment);
      EXPECT_EQ(found[0].distance_um, expected[0].distance_um);
    }
  }
  const auto mean = [](std::uint64_t sum) { return static_cast<double>(sum) / kJumps; };
  std::printf("directory: %.2f reads, %.0f bytes; packs: %.2f reads\n", mean(directory.count), mean(directory.bytes),
              mean(packs.count));
  EXPECT_LT(mean(directory.count), 2.0);
  EXPECT_LT(mean(directory.bytes), 8000);
}

TEST_F(PagedSet, TheBoxesOfPagesHoldTheirTiles) {
  const auto set = TileSet::open(path_);
  const auto holds = [](const std::vector<GridBox>& boxes, const GridBox& content) {
    return std::any_of(boxes.begin(), boxes.end(),
                       [&](const GridBox& box) { return box.contains(content.lo) && box.contains(content.hi); });
  };
  std::size_t several = 0;
  for (TileId tile = 0; tile < set->tile_count(); ++tile) {
    if (tile == set->long_tile()) continue;
    const GridBox& content = set->entry(tile).content;
    EXPECT_TRUE(holds(set->pageBoxes(tile / kPage), content)) << tile;
    EXPECT_TRUE(holds(set->groupBoxes(tile / kPage / kGroup), content)) << tile;
    several += set->groupBoxes(tile / kPage / kGroup).size() > 1 ? 1 : 0;
  }
  EXPECT_GT(several, 0u);
}

TEST_F(PagedSet, ATargetIsFoundWithFewPages) {
  Metered::Reads reads;
  const auto set = TileSet::open(std::make_unique<Metered>(path_, reads, "directory.bin"));
  const auto whole = TileSet::open(path_);
  const Vector3d p_W = set->grid().toWorld(whole->entry(whole->tile_count() / 3).content.lo);
  const auto hits = TileFinder(*set).within(p_W, 4.0);
  EXPECT_LT(reads.count, set->tile_count() / kPage / 4);
  const auto expected = TileFinder(*whole).within(p_W, 4.0);
  ASSERT_EQ(hits.size(), expected.size());
  std::vector<TileId> brute;
  const Vector3d quantum = Vector3d::Constant(set->grid().quantum_um());
  for (TileId t = 0; t < whole->tile_count(); ++t) {
    const GridBox& box = whole->entry(t).content;
    const Vector3d lo = set->grid().toWorld(box.lo) - quantum, hi = set->grid().toWorld(box.hi) + quantum;
    if (t != whole->long_tile() && (lo - p_W).cwiseMax(p_W - hi).cwiseMax(0.0).norm() <= 2.0) brute.push_back(t);
  }
  std::vector<TileId> found;
  for (const auto& hit : hits) found.push_back(hit.tile);
  std::sort(found.begin(), found.end());
  EXPECT_EQ(found, brute);
}

// The table of cells, in more than three pages.
TEST(TileSet, ReadsAPageOfTheCellsWhenItIsNeeded) {
  const test::TempFolder folder;
  const std::string path = ingested(folder, test::randomColumn(54, 900, 3, 50), 500);
  Metered::Reads reads;
  const auto metered = [&] {
    auto set = TileSet::open(std::make_unique<Metered>(path, reads, "cells.bin"));
    reads = {};
    return set;
  };
  const auto whole = TileSet::open(path);
  for (std::uint32_t cell = 0; cell < 900; cell += 71) {
    const std::string name = whole->cell(cell).name;
    auto set = metered();
    EXPECT_EQ(set->findCell(name), cell);
    EXPECT_LE(reads.count, 2u) << "the root and a page of names";
    set = metered();
    EXPECT_EQ(set->cell(cell).name, name);
    EXPECT_EQ(set->cell(cell).source, whole->cell(cell).source);
    EXPECT_EQ(reads.count, 2u) << "the root and a page of records";
    set = metered();
    EXPECT_EQ(set->loadCellDetail(cell).sample_ids, whole->loadCellDetail(cell).sample_ids);
    EXPECT_EQ(reads.count, 3u) << "the root, a page of records and the detail";
  }
  for (const char* none : {"", "zzz", "nobody"}) EXPECT_FALSE(whole->findCell(none)) << none;
  EXPECT_NO_THROW(whole->checkCells());
  EXPECT_THROW(whole->loadCellDetail(900), std::out_of_range);
  EXPECT_THROW(whole->cell(900), std::out_of_range);
}

TEST(TileSet, OfCellsOfOneNameTheLowestIsFound) {
  const test::TempFolder folder;
  std::vector<Cell> cells = test::randomColumn(55, 700, 3, 50);
  for (std::size_t i = 100; i < 700; ++i) cells[i].name = "twin";
  const auto set = TileSet::open(ingested(folder, cells, 500));
  EXPECT_EQ(set->findCell("twin"), 100u);
}

TEST(TileSet, KeepsSections) {
  const test::TempFolder folder;
  CellList stream(std::vector<Cell>{test::randomNeuron(1)});
  const std::vector<std::uint8_t> bytes{1, 2, 0, 255};
  const auto with = [](const char* name, std::vector<std::uint8_t> content) {
    return [=] { return std::map<std::string, std::vector<std::uint8_t>>{{"empty", {}}, {name, content}}; };
  };
  ingest(stream, folder / "a.fil", {.sections = with("soma-notes", bytes)});
  const auto set = TileSet::open(folder / "a.fil");
  EXPECT_EQ(set->sections(), (std::vector<std::string>{"empty", "soma-notes"}));
  EXPECT_EQ(set->section("soma-notes"), bytes);
  EXPECT_EQ(set->section("empty"), std::vector<std::uint8_t>{});
  EXPECT_EQ(set->section("none"), std::nullopt);
  EXPECT_TRUE(verify(folder / "a.fil", {.deep = true}).sound());
  test::writeBytes(folder / "a.fil/" + set->revision() + "/section-soma-notes.bin", "abcd");
  EXPECT_THROW(TileSet::open(folder / "a.fil")->section("soma-notes"), CorruptSet);
  EXPECT_FALSE(verify(folder / "a.fil").sound());
  CellList other(std::vector<Cell>{test::randomNeuron(1)});
  EXPECT_THROW(ingest(other, folder / "b.fil", {.sections = with("../x", bytes)}), UsageError);
}

TEST(TileSet, ASetOfAnOlderVersionIsToBeIngestedAgain) {
  const test::TempFolder folder;
  const std::string path = ingested(folder, {test::randomNeuron(1)});
  const std::string name = test::readBytes(path + "/CURRENT").substr(0, 18);
  const std::string good = test::readBytes(path + "/" + name + "/manifest.json");
  for (const auto& [version, message] : {std::pair("1", "was made by an older filiform; ingest it again"),
                                         std::pair("4", "has format 4, this filiform reads formats 2 and 3; use")}) {
    std::string text = good;
    text.replace(text.find("\"version\": 3") + 11, 1, version);
    const std::string revision = internal::revisionName(text);
    fs::create_directory(path + "/" + revision);
    test::writeBytes(path + "/" + revision + "/manifest.json", text);
    test::writeBytes(path + "/CURRENT", revision + "\n");
    try {
      TileSet::open(path);
      FAIL();
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(message), std::string::npos) << error.what();
      EXPECT_TRUE(std::string(error.what()).starts_with(path + ": ")) << error.what();
    }
  }
}

TEST_F(PagedSet, ALoadedTileKnowsTheHomesOfItsNodes) {
  const auto whole = TileSet::open(path_);
  whole->checkDirectory();
  std::size_t elsewhere = 0;  // nodes whose home is in another page
  for (TileId tile = 0; tile < whole->tile_count(); tile += 13) {
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
  for (std::uint32_t group = 0; group * kGroup * kPage < set->tile_count(); ++group) {
    GridBox content;
    for (std::uint32_t page = group * kGroup; page < (group + 1) * kGroup && page * kPage < set->tile_count(); ++page)
      content.extend(set->pageContent(page));
    EXPECT_EQ(set->groupContent(group).lo, content.lo);
    EXPECT_EQ(set->groupContent(group).hi, content.hi);
  }
}

TEST_F(PagedSet, ADamagedPageIsFoundBeforeItIsUsed) {
  const std::string file = directoryFile(), good = test::readBytes(file);
  Metered::Reads reads;
  TileSet::open(std::make_unique<Metered>(path_, reads, "directory.bin"))->entry(0);
  const std::size_t page_at = 16 + reads.bytes - 4;  // in the last page of the first group: a checksum
  const GridPoint there = mortonPoint(TileSet::open(path_)->entry(kPage + 1).key.low);
  std::string bytes = good;
  bytes[page_at] ^= 1;
  test::writeBytes(file, bytes);
  const auto set = TileSet::open(path_);
  set->entry(kGroup * kPage);
  try {
    set->entry(kPage);
    FAIL();
  } catch (const CorruptSet& error) {
    EXPECT_NE(std::string(error.what()).find("directory.bin"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("page 3"), std::string::npos) << error.what();
  }
  EXPECT_THROW(set->home(there), CorruptSet);
  EXPECT_EQ(set->leaves().home(there), kNoTile);
  EXPECT_THROW(set->load(kPage + 1), CorruptSet);
  EXPECT_THROW(set->checkDirectory(), CorruptSet);
  const VerifyReport report = verify(path_);
  EXPECT_EQ(report.problem_count, 1u);
  test::writeBytes(file, good);
  EXPECT_TRUE(verify(path_).sound());
}

TEST(TileSet, ARevisionIsOpenedByItsNameOrItsLossIsOneLine) {
  const test::TempFolder folder;
  const std::string path = ingested(folder, {test::randomNeuron(1)});
  const std::string first = TileSet::open(path)->revision();
  EXPECT_EQ(TileSet::open(path, {}, first)->revision(), first);
  std::vector<Cell> second{test::randomNeuron(2)};
  CellList list(second);
  ingest(list, path, {.force = true});
  EXPECT_NE(TileSet::open(path)->revision(), first);
  try {
    TileSet::open(path, {}, first);
    FAIL();
  } catch (const IoError& error) {
    const std::string what = error.what();
    EXPECT_EQ(what.find(path + ": the revision " + first + " cannot be read ("), 0u) << what;
    EXPECT_NE(what.find("open the set again"), std::string::npos) << what;
  }
  for (const char* const wrong : {"../a", "r-1", "r-00000000000000zz", "CURRENT"})
    EXPECT_THROW(TileSet::open(path, {}, wrong), UsageError) << wrong;
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
