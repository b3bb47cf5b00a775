#include "index/subsets/set_cells.h"

#include "index/errors.h"
#include "index/ingest/growth.h"
#include "index/ingest/ingest.h"
#include "index/subsets/subset.h"
#include "index/verify/verify.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/temp_folder.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <random>

#include <gtest/gtest.h>

namespace filiform {
namespace {

namespace fs = std::filesystem;

// Cells with all that a set can keep: attributes, odd radii, headers, loops, isolated samples, id blocks.
std::vector<Cell> richColumn() {
  std::vector<Cell> cells = test::randomColumn(31, 9, 300, 100);
  std::mt19937_64 random(31);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    Cell& cell = cells[i];
    cell.digest = random();
    cell.name = "given " + std::to_string(i);
    cell.header = "# cell " + std::to_string(i);
    for (std::uint16_t& type : cell.types) type = static_cast<std::uint16_t>(2 + random() % 2);
    cell.odd_radii = {{3, 0.123456789}, {7, 1.000000123}};
    for (const OddRadius& odd : cell.odd_radii) cell.radii_um[odd.rank] = storedRadius(odd.radius_um);
    cell.attributes = {{"layer", std::int64_t(i)}};
    if (i % 2 == 0) cell.attributes.push_back({"mtype", std::string("L5_") + std::to_string(i)});
  }
  for (Cell extra : {test::isolatedNodes(3, 30, 90), test::hub(40, 60)}) {
    extra.source = "z" + std::to_string(100 + cells.size());
    cells.push_back(std::move(extra));
  }
  Cell loop;
  for (const Vector3d& p : {Vector3d(0, 0, 0), Vector3d(9, 0, 0), Vector3d(9, 9, 0)}) test::addSample(loop, p);
  connect(loop, {{0, 1}, {1, 2}, {2, 0}});
  loop.source = "zz";
  cells.push_back(std::move(loop));
  return cells;
}

std::map<std::string, std::string> filesOf(const std::string& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file())
      files[fs::relative(entry.path(), folder).string()] = test::readBytes(entry.path().string());
  return files;
}

class SetCellsTest : public ::testing::Test {
 protected:
  std::string path(const std::string& name) const { return folder_ / name; }
  void make(const std::vector<Cell>& cells, const std::string& name) const {
    CellList stream(cells);
    ingest(stream, path(name), kOptions);
  }
  // A set of some cells of another.
  void makePart(const TileSet& set, const std::vector<std::uint32_t>& cells, const std::string& name,
                SetCellsOptions options = {}) const {
    SetCells stream(set, cells, std::move(options));
    ingest(stream, path(name), kOptions);
    EXPECT_TRUE(verify(path(name), {.deep = true}).sound());
  }
  static inline const IngestOptions kOptions{.capacity = 40, .levels = true};
  test::TempFolder folder_;
};

TEST_F(SetCellsTest, APartHasTheBytesOfASetMadeFromItsCellsAlone) {
  const std::vector<Cell> cells = richColumn();
  make(cells, "whole.fil");
  const auto set = TileSet::open(path("whole.fil"));
  std::vector<std::uint32_t> some;
  std::vector<Cell> chosen;
  for (std::uint32_t i = 1; i < cells.size(); i += 2) {
    some.push_back(i);
    chosen.push_back(cells[i]);
  }
  make(chosen, "expected.fil");
  std::reverse(some.begin(), some.end());
  makePart(*set, some, "part.fil");
  EXPECT_TRUE(filesOf(path("part.fil")) == filesOf(path("expected.fil")));
  // The cells in several passes.
  makePart(*set, some, "passes.fil", {.memory_bytes = 1, .threads = 2});
  EXPECT_TRUE(filesOf(path("passes.fil")) == filesOf(path("expected.fil")));
  // All cells.
  std::vector<std::uint32_t> all(cells.size());
  for (std::uint32_t i = 0; i < all.size(); ++i) all[i] = i;
  makePart(*set, all, "copy.fil");
  EXPECT_TRUE(filesOf(path("copy.fil")) == filesOf(path("whole.fil")));
}

TEST_F(SetCellsTest, APartOfASetThatHasGrownIsThatOfItsCells) {
  const std::vector<Cell> cells = richColumn();
  std::vector<Cell> first, later;
  for (std::size_t i = 0; i < cells.size(); ++i) (i == 2 ? later : first).push_back(cells[i]);
  make(first, "grown.fil");
  CellList added(later);
  addCells(added, path("grown.fil"), {});
  removeCells({"given 4"}, path("grown.fil"));
  const auto set = TileSet::open(path("grown.fil"));
  std::vector<std::uint32_t> some;
  for (const char* const name : {"given 5", "given 2", "given 1"}) some.push_back(set->findCell(name).value());
  makePart(*set, some, "part.fil");
  make({cells[1], cells[2], cells[5]}, "expected.fil");
  EXPECT_TRUE(filesOf(path("part.fil")) == filesOf(path("expected.fil")));
}

TEST_F(SetCellsTest, TypesChooseSamples) {
  make(richColumn(), "whole.fil");
  const auto set = TileSet::open(path("whole.fil"));
  std::vector<std::uint32_t> some{0, 2, 9, 11};  // 9 and 11 have only samples of type 3
  makePart(*set, some, "axons.fil", {.types = {2}});
  const auto part = TileSet::open(path("axons.fil"));
  ASSERT_EQ(part->cell_count(), 2u);
  for (std::uint32_t i = 0; i < 2; ++i) {
    CellGraph expected = readCell(*set, some[i], true);
    keepTypes(expected, {2});
    const CellGraph found = readCell(*part, i, true);
    EXPECT_EQ(found.name, expected.name);
    EXPECT_EQ(found.positions, expected.positions);
    EXPECT_EQ(found.parents, expected.parents);
    EXPECT_EQ(found.sample_ids, expected.sample_ids);
    EXPECT_EQ(found.header, expected.header);
  }
}

TEST_F(SetCellsTest, SourcesAreThoseOfTheCells) {
  std::vector<Cell> cells = richColumn();
  const std::vector<std::string> names{"a.swc", "b.zip/x.swc", "b.zip/y/z.swc", "b.zipped.swc"};
  cells.resize(names.size());
  for (std::size_t i = 0; i < names.size(); ++i) cells[i].source = names[i];
  CellList stream(cells);
  IngestOptions options;
  options.provenance = [] {
    Provenance all;
    all.sources = {{"a.swc", 7, 1, 1}, {"b.zip", 8, 2, 2}, {"b.zipped.swc", 9, 3, 1}};
    all.refused = {{"c.swc", "E_EMPTY", "no sample"}};
    return all;
  };
  ingest(stream, path("whole.fil"), options);
  const auto set = TileSet::open(path("whole.fil"));
  const Provenance part = SetCells(*set, {0, 2}).provenance();
  ASSERT_EQ(part.sources.size(), 2u);
  EXPECT_EQ(part.sources[0].name, "a.swc");
  EXPECT_EQ(part.sources[1].name, "b.zip");
  EXPECT_EQ(part.sources[1].bytes, 8u);
  EXPECT_EQ(part.sources[1].cells, 1u);
  EXPECT_TRUE(part.refused.empty());
}

TEST_F(SetCellsTest, AnInterruptionLeavesNothing) {
  make(richColumn(), "whole.fil");
  const auto set = TileSet::open(path("whole.fil"));
  SetCells stream(*set, {0, 1, 2}, {.check = [] { throw Interrupted("interrupted"); }});
  EXPECT_THROW(ingest(stream, path("part.fil"), kOptions), Interrupted);
  EXPECT_FALSE(fs::exists(path("part.fil")));
}

}  // namespace
}  // namespace filiform
