// The sets below version_2/ were written in format 2 from the SWC files beside them, with 16 segments a tile. c.swc was
// added to `grown` later.
#include "index/set/internal/old_directory.h"

#include "index/errors.h"
#include "index/formats/swc.h"
#include "index/ingest/growth.h"
#include "index/levels/levels.h"
#include "index/query/cell_graph.h"
#include "index/query/nearest.h"
#include "index/verify/verify.h"
#include "tests/support/folders.h"
#include "tests/support/temp_folder.h"

#include <filesystem>
#include <random>
#include <sstream>

#include <gtest/gtest.h>

namespace filiform {
namespace {

namespace fs = std::filesystem;

const std::string kOldSets = test::inSource("tests/index/set/version_2");

struct OldSet {
  const char* name;
  std::vector<std::string> cells;
  bool levels;
};
const std::vector<OldSet> kBoth{{"whole", {"a.swc", "b.swc"}, true}, {"grown", {"a.swc", "b.swc", "c.swc"}, false}};

std::vector<Cell> cellsOf(const OldSet& old) {
  std::vector<Cell> cells;
  for (const std::string& file : old.cells) {
    Cell& cell = cells.emplace_back();
    readSwc(test::readBytes(kOldSets + "/" + file), file, {}, cell);
    cell.source = file;
  }
  return cells;
}

std::string copied(const OldSet& old, const test::TempFolder& folder) {
  const std::string path = folder / (std::string(old.name) + ".fil");
  fs::copy(kOldSets + "/" + old.name, path, fs::copy_options::recursive);
  return path;
}

std::string answers(const TileSet& set) {
  std::ostringstream out;
  for (std::uint32_t c = 0; c < set.cell_count(); ++c) writeSwc(out, readCell(set, c, true));
  for (TileId t = 0; t < set.tile_count(); ++t)
    out << set.entry(t).content.lo.transpose() << ' ' << set.entry(t).content.hi.transpose() << '\n';
  std::mt19937_64 random(5);
  const Nearest nearest(set);
  for (int i = 0; i < 100; ++i) {
    Vector3d h_W;
    for (int axis = 0; axis < 3; ++axis) h_W[axis] = static_cast<double>(random() % 100) - 50;
    for (const NearestResult& r : nearest.find(h_W, {.k = 3})) out << r.segment.key() << ' ' << r.p_W.transpose();
  }
  return out.str();
}

TEST(OldDirectory, SetsOfVersion2GiveTheSameAnswers) {
  for (const OldSet& old : kBoth) {
    SCOPED_TRACE(old.name);
    const test::TempFolder folder;
    const auto set = TileSet::open(kOldSets + "/" + old.name);
    EXPECT_EQ(set->format(), 2u);
    const VerifyReport report = verify(kOldSets + "/" + old.name, {.deep = true});
    EXPECT_TRUE(report.sound()) << report.problems.front();
    CellList cells(cellsOf(old));
    ingest(cells, folder / "new.fil", {.capacity = 16});
    EXPECT_EQ(answers(*set), answers(*TileSet::open(folder / "new.fil")));
    EXPECT_EQ(Levels::open(*set) != nullptr, old.levels);
  }
}

TEST(OldDirectory, ASetOfVersion2GrowsOnceItIsCompact) {
  for (const OldSet& old : kBoth) {
    SCOPED_TRACE(old.name);
    const test::TempFolder folder;
    const std::string path = copied(old, folder);
    Cell more = cellsOf(old).front();
    more.source = "d.swc";
    const auto refused = [&](const auto& change) {
      try {
        change();
        ADD_FAILURE();
      } catch (const InputError& error) {
        EXPECT_NE(std::string(error.what()).find("format 2; run filiform compact "), std::string::npos) << error.what();
      }
    };
    CellList stream(std::vector<Cell>{more});
    refused([&] { addCells(stream, path); });
    refused([&] { removeCells({"a"}, path); });
    refused([&] { syncCells(stream, path, {}, {}); });
    EXPECT_EQ(TileSet::open(path)->format(), 2u);
    const std::string before = answers(*TileSet::open(path));
    compactSet(path);
    EXPECT_EQ(TileSet::open(path)->format(), internal::kFormatVersion);
    EXPECT_EQ(answers(*TileSet::open(path)), before);
    addCells(stream, path);
    EXPECT_EQ(TileSet::open(path)->cell_count(), old.cells.size() + 1);
    const VerifyReport report = verify(path, {.deep = true});
    EXPECT_TRUE(report.sound()) << report.problems.front();
  }
}

// Of both versions: the answers are right, or the file is named.
void damageDirectory(const std::string& path) {
  const std::string revision = TileSet::open(path)->revision(), good = answers(*TileSet::open(path));
  const std::string file = path + "/" + revision + "/directory.bin", bytes = test::readBytes(file);
  const auto expectFound = [&](std::size_t at, const std::string& damaged) {
    test::writeBytes(file, damaged);
    try {
      EXPECT_EQ(answers(*TileSet::open(path)), good) << at;
      EXPECT_TRUE(damaged.size() == bytes.size() && at < internal::kDirectoryHeaderBytes) << at;
    } catch (const CorruptSet& error) {
      EXPECT_NE(std::string(error.what()).find("directory.bin"), std::string::npos) << error.what();
    }
  };
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    std::string damaged = bytes;
    damaged[at] = static_cast<char>(damaged[at] ^ (1 << at % 8));
    expectFound(at, damaged);
    expectFound(at, bytes.substr(0, at));
  }
  test::writeBytes(file, bytes);
}

TEST(OldDirectory, EveryDamagedByteAndEveryLengthIsFound) {
  const test::TempFolder folder;
  const std::string path = copied(kBoth.front(), folder);
  damageDirectory(path);
  compactSet(path);
  damageDirectory(path);
}

}  // namespace
}  // namespace filiform
