#include "index/query/cell_graph.h"

#include "index/errors.h"
#include "index/formats/swc.h"
#include "tests/support/scenes/counting_store.h"
#include "tests/support/scenes/memory_store.h"
#include "tests/support/scenes/omitting_store.h"
#include "tests/support/scenes/random_cells.h"

#include <atomic>
#include <cmath>
#include <map>
#include <set>
#include <sstream>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::storeOf;

bool sameFloat(float a, float b) { return a == b || (std::isnan(a) && std::isnan(b)); }

struct SwcRow {
  std::int64_t id, parent;
  int type;
  std::string x, y, z, radius;
};

std::vector<SwcRow> rowsOf(const std::string& text) {
  std::vector<SwcRow> rows;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("#")) continue;
    std::istringstream fields(line);
    SwcRow r;
    fields >> r.id >> r.type >> r.x >> r.y >> r.z >> r.radius >> r.parent;
    EXPECT_TRUE(fields && fields.get() == EOF) << line;
    rows.push_back(r);
  }
  return rows;
}

std::string exported(const CellGraph& cell) {
  std::ostringstream out;
  writeSwc(out, cell);
  return out.str();
}

TEST(CellGraph, IsTheCellThatWasRead) {
  std::vector<test::NamedCells> all = test::worstCases();
  all.push_back({"column", test::randomColumn(61, 8, 300, 100)});
  for (const test::NamedCells& named : all) {
    SCOPED_TRACE(named.name);
    const auto store = storeOf(named.cells, 30);
    for (std::uint32_t c = 0; c < named.cells.size(); ++c) {
      const Cell& cell = named.cells[c];
      const CellGraph graph = readCell(*store, c, true);
      EXPECT_EQ(graph.source, cell.source);
      EXPECT_EQ(graph.parents, cell.parents);
      EXPECT_EQ(graph.sample_ids, cell.sample_ids);
      EXPECT_EQ(graph.types, cell.types);
      EXPECT_EQ(graph.block_starts, cell.block_starts);
      ASSERT_EQ(graph.samples(), cell.samples());
      for (std::uint32_t i = 0; i < cell.samples(); ++i) {
        ASSERT_EQ(graph.positions[i], store->grid().snap(cell.positions_um[i]));
        ASSERT_TRUE(sameFloat(graph.radii_um[i], cell.radii_um[i]));
      }
      const CellGraph bare = readCell(*store, c, false);
      EXPECT_EQ(bare.parents, cell.parents);
      EXPECT_TRUE(bare.radii_um.empty() && bare.types.empty());
    }
  }
}

TEST(CellGraph, ExportedTextEqualsTheInputUpToTheGrid) {
  for (const test::NamedCells& named : test::worstCases()) {
    SCOPED_TRACE(named.name);
    const auto store = storeOf(named.cells, 30);
    for (std::uint32_t c = 0; c < named.cells.size(); ++c) {
      const Cell& cell = named.cells[c];
      const std::vector<SwcRow> rows = rowsOf(exported(readCell(*store, c, true)));
      ASSERT_EQ(rows.size(), cell.samples());
      std::set<std::int64_t> ids;
      for (std::uint32_t i = 0; i < rows.size(); ++i) {
        const Vector3d p_W(std::strtod(rows[i].x.c_str(), nullptr), std::strtod(rows[i].y.c_str(), nullptr),
                           std::strtod(rows[i].z.c_str(), nullptr));
        ASSERT_EQ(store->grid().snap(p_W), store->grid().snap(cell.positions_um[i]));
        ASSERT_EQ(std::strtof(rows[i].radius.c_str(), nullptr), std::isnan(cell.radii_um[i]) ? 0 : cell.radii_um[i]);
        ASSERT_EQ(rows[i].type, cell.types[i]);
        ASSERT_EQ(rows[i].parent, cell.parents[i] == kNoParent ? -1 : rows[cell.parents[i]].id);
        ASSERT_TRUE(ids.insert(rows[i].id).second);
        if (cell.block_starts.empty()) {
          ASSERT_EQ(rows[i].id, cell.sample_ids[i]);
        }
      }
    }
  }
}

TEST(CellGraph, RestartedBlocksAreRenumberedAndThatIsSaid) {
  Cell cell;
  for (int i = 0; i < 6; ++i)
    test::addSample(cell, Vector3d(i, 0, 0), i % 3 == 0 ? kNoParent : static_cast<std::uint32_t>(i - 1));
  cell.sample_ids = {1, 2, 7, 1, 2, 3};
  cell.block_starts = {3};
  const std::string text = exported(readCell(*storeOf({cell}, 10), 0, true));
  std::vector<std::int64_t> ids;
  for (const SwcRow& row : rowsOf(text)) ids.push_back(row.id);
  EXPECT_EQ(ids, (std::vector<std::int64_t>{1, 2, 7, 8, 9, 10}));
  EXPECT_NE(text.find("renumbered"), std::string::npos);
  cell.sample_ids = {1, 2, INT64_MAX, 1, 2, 3};
  ids.clear();
  for (const SwcRow& row : rowsOf(exported(readCell(*storeOf({cell}, 10), 0, true)))) ids.push_back(row.id);
  EXPECT_EQ(ids, (std::vector<std::int64_t>{1, 2, 3, 4, 5, 6}));
}

TEST(CellGraph, PlainNumbersAndNoLineBreaksFromNames) {
  Cell cell;
  cell.source = "evil\n1 1 0 0 0 1 -1\n.swc";
  test::addSample(cell, Vector3d(1e9, -0.001953125, 0.1), kNoParent, kUnknownRadius, 65535);
  const std::string text = exported(readCell(*storeOf({cell}, 10), 0, true));
  const std::vector<SwcRow> rows = rowsOf(text);
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0].x, "1000000000");
  EXPECT_EQ(rows[0].y, "-0.002") << "the fewest decimals of that grid point";
  EXPECT_EQ(rows[0].z, "0.1");
  EXPECT_EQ(rows[0].radius, "0");  // unknown
}

// Header lines, radii of many digits, ids and links: all text but the lines about the set itself.
TEST(CellGraph, HeaderAndOddRadiiComeBackAsText) {
  const std::string source =
      "# ORIGINAL_SOURCE a microscope\n# n,type,x,y,z,radius,parent\n"
      "1 1 0 0 0 5.1234567891 -1\n2 3 0 6.5 0 0.1 1\n3 3 0 7 0 0.6700000166893005 2\n4 3 0 8 0.25 1e-50 3\n";
  Cell cell;
  readSwc(source, "a.swc", {}, cell);
  cell.source = "a.swc";
  const CellGraph graph = readCell(*storeOf({cell}, 10), 0, true);
  std::string text = exported(graph);
  for (const std::string ours : {"# a\n", "# source: a.swc\n", "# id type x y z radius parent, um\n"}) {
    const std::size_t at = text.find(ours);
    ASSERT_NE(at, std::string::npos) << ours;
    text.erase(at, ours.size());
  }
  EXPECT_EQ(text, source);

  Cell again;
  readSwc(exported(graph), "a.swc", {}, again);
  again.source = "a.swc";
  EXPECT_EQ(exported(readCell(*storeOf({again}, 10), 0, true)), exported(graph)) << "nothing is written twice";
}

TEST(CellGraph, AReadThatIsToldToStopReadsNoTile) {
  const auto store = storeOf(test::randomColumn(3, 1, 200, 80), 32);
  const test::CountingStore counting(*store);
  const std::atomic<bool> stop{true};
  EXPECT_THROW(readCell(counting, 0, true, &stop), Interrupted);
  EXPECT_TRUE(counting.loads().empty());
}

TEST(CellGraph, AMissingSampleIsNeverSilent) {
  const auto store = storeOf({test::randomNeuron(62)}, 30);
  EXPECT_THROW(readCell(test::OmittingStore(*store), 0, false), CorruptSet);
}

}  // namespace
}  // namespace filiform
