#include "index/ingest/growth.h"

#include "index/errors.h"
#include "index/query/cell_graph.h"
#include "index/query/nearest.h"
#include "index/verify/verify.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/temp_folder.h"

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <map>
#include <random>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

namespace filiform {
namespace {

namespace fs = std::filesystem;
using test::TempFolder;

constexpr std::uint32_t kCapacity = 40;

std::vector<Cell> column(std::uint64_t seed, std::uint32_t cells = 14) {
  std::vector<Cell> all = test::randomColumn(seed, cells, 260, 150);
  std::mt19937_64 random(seed);
  for (Cell& cell : all)
    for (float& radius : cell.radii_um) radius = 0.25f * static_cast<float>(random() % 8);
  return all;
}

std::vector<Cell> some(const std::vector<Cell>& all, std::size_t begin, std::size_t end) {
  return {all.begin() + static_cast<std::ptrdiff_t>(begin), all.begin() + static_cast<std::ptrdiff_t>(end)};
}

IngestResult make(const std::vector<Cell>& cells, const std::string& path) {
  CellList stream(cells);
  return ingest(stream, path, {.capacity = kCapacity});
}

GrowthResult add(const std::vector<Cell>& cells, const std::string& path, const IngestOptions& options = {}) {
  CellList stream(cells);
  return addCells(stream, path, options);
}

std::map<std::string, std::string> contentsOf(const std::string& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file())
      files[fs::relative(entry.path(), folder).string()] = test::readBytes(entry.path().string());
  return files;
}

void expectSound(const std::string& path) {
  const VerifyReport report = verify(path, {.deep = true});
  EXPECT_TRUE(report.sound()) << report.problems.front();
}

// The same answers, by the names of cells: distance, position, segment, ties included.
void expectSameAnswers(const std::string& path, const std::string& expected_path, std::uint64_t seed) {
  const auto set = TileSet::open(path), expected = TileSet::open(expected_path);
  const Nearest nearest(*set), reference(*expected);
  EXPECT_EQ(set->counts().cells, expected->counts().cells);
  EXPECT_EQ(set->counts().segments, expected->counts().segments);
  EXPECT_EQ(set->counts().isolated, expected->counts().isolated);
  EXPECT_EQ(set->bounds().lo, expected->bounds().lo);
  EXPECT_EQ(set->bounds().hi, expected->bounds().hi);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> place(-60, 260);
  for (int i = 0; i < 60; ++i) {
    const Vector3d p_W(place(random), place(random), place(random));
    const auto found = nearest.find(p_W, {.k = 5}), wanted = reference.find(p_W, {.k = 5});
    ASSERT_EQ(found.size(), wanted.size());
    for (std::size_t k = 0; k < found.size(); ++k) {
      EXPECT_EQ(found[k].distance_um, wanted[k].distance_um);
      EXPECT_EQ(found[k].p_W, wanted[k].p_W);
      EXPECT_EQ(found[k].segment.segment, wanted[k].segment.segment);
      EXPECT_EQ(set->cell(found[k].segment.cell).name, expected->cell(wanted[k].segment.cell).name);
    }
  }
  for (std::uint32_t c = 0; c < expected->cell_count(); ++c) {
    const std::string& name = expected->cell(c).name;
    const auto cell = set->findCell(name);
    ASSERT_TRUE(cell) << name;
    if (hasLoops(expected->cell(c))) continue;
    std::ostringstream one, other;
    writeSwc(one, readCell(*set, *cell, true));
    writeSwc(other, readCell(*expected, c, true));
    EXPECT_EQ(one.str(), other.str());
  }
}

TEST(Growth, AnswersAsOneIngestOfEverything) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(seed);
    const TempFolder folder;
    const std::vector<Cell> all = column(seed);
    make(all, folder / "all.fil");
    make(some(all, 0, 11), folder / "a.fil");
    const GrowthResult first = add(some(all, 11, 13), folder / "a.fil");
    EXPECT_FALSE(first.compacted);
    EXPECT_GT(first.tiles_patched, 0u);
    expectSound(folder / "a.fil");
    add(some(all, 13, 14), folder / "a.fil");
    expectSound(folder / "a.fil");
    expectSameAnswers(folder / "a.fil", folder / "all.fil", seed);
  }
}

TEST(Growth, CompactSetsHaveTheBytesOfOneIngest) {
  const TempFolder folder;
  const std::vector<Cell> all = column(11);
  make(all, folder / "all.fil");
  make(some(all, 0, 10), folder / "a.fil");
  add(some(all, 10, 12), folder / "a.fil");
  add(some(all, 12, 14), folder / "a.fil");
  EXPECT_NE(contentsOf(folder / "a.fil"), contentsOf(folder / "all.fil"));
  EXPECT_TRUE(compactSet(folder / "a.fil").compacted);
  EXPECT_EQ(contentsOf(folder / "a.fil"), contentsOf(folder / "all.fil"));
  EXPECT_TRUE(compactSet(folder / "a.fil").set.unchanged);
}

// Placements of one morphology have one source.
TEST(Growth, CellsOfOneSourceAreOrderedByDigest) {
  const TempFolder folder;
  std::vector<Cell> all = column(12);
  for (std::size_t i = 0; i < all.size(); ++i) {
    all[i].source = i < 8 ? "a.swc" : "b.swc";
    all[i].name = "cell " + std::to_string(i);
    all[i].digest = 100 + i;
  }
  std::vector<Cell> odd, even;
  for (std::size_t i = 0; i < all.size(); ++i) (i % 2 == 0 ? even : odd).push_back(all[i]);
  make(all, folder / "all.fil");
  make(odd, folder / "a.fil");
  add(even, folder / "a.fil");
  compactSet(folder / "a.fil");
  EXPECT_EQ(contentsOf(folder / "a.fil"), contentsOf(folder / "all.fil"));
}

TEST(Growth, AnAdditionThatIsNotSmallMakesACompactSet) {
  const TempFolder folder;
  const std::vector<Cell> all = column(12);
  make(all, folder / "all.fil");
  make(some(all, 0, 3), folder / "a.fil");
  EXPECT_TRUE(add(some(all, 3, 14), folder / "a.fil").compacted);
  EXPECT_EQ(contentsOf(folder / "a.fil"), contentsOf(folder / "all.fil"));
}

TEST(Growth, EmptySpaceLongSegmentsAndGraphsMayBeAdded) {
  for (test::NamedCells& named : test::worstCases()) {
    SCOPED_TRACE(named.name);
    const TempFolder folder;
    std::vector<Cell> all = column(13);
    const std::size_t before = all.size();
    for (std::size_t i = 0; i < named.cells.size(); ++i) {
      named.cells[i].source = "z" + std::to_string(100 + i) + ".swc";
      named.cells[i].name.clear();
      all.push_back(named.cells[i]);
    }
    make(all, folder / "all.fil");
    make(some(all, 0, before), folder / "a.fil");
    add(named.cells, folder / "a.fil");
    expectSound(folder / "a.fil");
    expectSameAnswers(folder / "a.fil", folder / "all.fil", 13);
    compactSet(folder / "a.fil");
    EXPECT_EQ(contentsOf(folder / "a.fil"), contentsOf(folder / "all.fil"));
  }
}

TEST(Growth, RemovedCellsAreGone) {
  for (std::uint64_t seed = 21; seed <= 24; ++seed) {
    SCOPED_TRACE(seed);
    const TempFolder folder;
    const std::vector<Cell> all = column(seed);
    make(some(all, 0, 12), folder / "a.fil");
    add(some(all, 12, 14), folder / "a.fil");
    std::vector<std::string> names;
    std::vector<Cell> rest;
    {
      const auto set = TileSet::open(folder / "a.fil");
      for (std::uint32_t c = 0; c < 14; ++c) {
        if (c % 5 == 2 || c == 13)
          names.push_back(set->cell(c).name);
        else
          rest.push_back(all[c]);
      }
    }
    make(rest, folder / "rest.fil");
    const GrowthResult removed = removeCells(names, folder / "a.fil");
    EXPECT_EQ(removed.set.counts.removed, names.size());
    expectSound(folder / "a.fil");
    expectSameAnswers(folder / "a.fil", folder / "rest.fil", seed);
    {
      const auto set = TileSet::open(folder / "a.fil");
      EXPECT_EQ(set->cell_count(), 14u);
      EXPECT_TRUE(set->cell(13).removed);
      for (const std::string& name : names) EXPECT_FALSE(set->findCell(name));
    }
    EXPECT_THROW(removeCells({names[0]}, folder / "a.fil"), UsageError);
    add({all[13]}, folder / "a.fil");
    expectSound(folder / "a.fil");
    removeCells({names.back()}, folder / "a.fil");
    compactSet(folder / "a.fil");
    EXPECT_EQ(contentsOf(folder / "a.fil"), contentsOf(folder / "rest.fil"));
  }
}

TEST(Growth, AllCellsMayBeRemoved) {
  const TempFolder folder;
  make(column(31, 2), folder / "a.fil");
  std::vector<std::string> names;
  for (std::uint32_t c = 0; c < 2; ++c) names.push_back(TileSet::open(folder / "a.fil")->cell(c).name);
  removeCells(names, folder / "a.fil");
  expectSound(folder / "a.fil");
  EXPECT_EQ(TileSet::open(folder / "a.fil")->tile_count(), 0u);
  compactSet(folder / "a.fil");
  make({}, folder / "none.fil");
  EXPECT_EQ(contentsOf(folder / "a.fil"), contentsOf(folder / "none.fil"));
}

TEST(Growth, RefusesANameThatExists) {
  const TempFolder folder;
  const std::vector<Cell> all = column(41);
  make(all, folder / "a.fil");
  const auto before = contentsOf(folder / "a.fil");
  const std::string name = TileSet::open(folder / "a.fil")->cell(3).name;
  try {
    add({all[3]}, folder / "a.fil");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << error.what();
  }
  EXPECT_THROW(removeCells({"nobody"}, folder / "a.fil"), UsageError);
  EXPECT_THROW(add({all[3]}, folder / "none.fil"), IoError);
  EXPECT_EQ(contentsOf(folder / "a.fil"), before);
}

TEST(Growth, OpenReadersKeepTheirRevision) {
  const TempFolder folder;
  const std::vector<Cell> all = column(42);
  make(some(all, 0, 12), folder / "a.fil");
  const auto reader = TileSet::open(folder / "a.fil");
  add(some(all, 12, 14), folder / "a.fil");
  const auto grown = TileSet::open(folder / "a.fil");
  compactSet(folder / "a.fil");
  std::uint64_t owned = 0;
  for (TileId t = 0; t < reader->tile_count(); ++t) owned += reader->load(t)->owned_count();
  EXPECT_EQ(owned, reader->counts().segments + reader->counts().isolated);
  owned = 0;
  for (TileId t = 0; t < grown->tile_count(); ++t) owned += grown->load(t)->owned_count();
  EXPECT_EQ(owned, grown->counts().segments + grown->counts().isolated);
}

// Stops at each report of progress in turn.
TEST(Growth, AnInterruptedCallLeavesTheSet) {
  const TempFolder folder;
  const std::vector<Cell> all = column(43);
  make(some(all, 0, 12), folder / "a.fil");
  add(some(all, 12, 13), folder / "a.fil");
  const auto before = contentsOf(folder / "a.fil");
  const std::string name = TileSet::open(folder / "a.fil")->cell(2).name;
  std::atomic<bool> cancel{false};
  const auto stopping = [&](int at) {
    IngestOptions options;
    options.cancel = &cancel;
    cancel = false;
    options.progress = [&cancel, left = at](const char*, std::uint64_t, std::uint64_t) mutable {
      if (left-- == 0) cancel = true;
    };
    return options;
  };
  int stopped = 0;
  for (int kind = 0; kind < 3; ++kind)
    for (int at = 0; at < 400; at = at < 12 ? at + 1 : at * 2) {
      try {
        fs::copy(folder / "a.fil", folder / "b.fil", fs::copy_options::recursive);
        if (kind == 0) add(some(all, 13, 14), folder / "b.fil", stopping(at));
        if (kind == 1) removeCells({name}, folder / "b.fil", stopping(at));
        if (kind == 2) compactSet(folder / "b.fil", stopping(at));
      } catch (const Interrupted&) {
        ++stopped;
        EXPECT_EQ(contentsOf(folder / "b.fil"), before) << kind << ' ' << at;
      }
      expectSound(folder / "b.fil");
      fs::remove_all(folder / "b.fil");
    }
  EXPECT_GT(stopped, 15);
}

}  // namespace
}  // namespace filiform
