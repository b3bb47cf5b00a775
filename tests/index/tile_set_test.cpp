#include "index/tile_set.h"

#include "index/errors.h"
#include "index/ingest.h"
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
        set->samples();
      });
  }
  for (std::uint64_t n : owned) EXPECT_EQ(n, set->counts().segments + set->counts().isolated);
}

}  // namespace
}  // namespace filiform
