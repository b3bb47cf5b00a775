#include "viewer/window/panels/internal/cell_table.h"

#include "index/errors.h"
#include "index/ingest/ingest.h"
#include "index/measure/set_measures.h"
#include "index/set/forwarding_store.h"
#include "tests/support/scenes/counting_store.h"
#include "tests/support/scenes/memory_store.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/temp_folder.h"

#include <chrono>
#include <cmath>
#include <functional>
#include <numeric>
#include <thread>

#include <gtest/gtest.h>

namespace filiform::internal {
namespace {

void serveUntil(CellTable& table, const std::function<bool()>& done) {
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (!done() && std::chrono::steady_clock::now() < until) {
    table.serve();
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  ASSERT_TRUE(done());
}

std::size_t columnNamed(const CellTable& table, const std::string& colouring) {
  for (std::size_t i = 0; i < table.columns().size(); ++i)
    if (table.columns()[i].colouring == colouring) return i;
  ADD_FAILURE() << colouring;
  return 0;
}

// Twelve cells of different lengths, named against their order; the last two without attributes.
class TableOfCells : public ::testing::Test {
 protected:
  static constexpr std::uint32_t kCells = 12;
  TableOfCells() {
    std::vector<Cell> cells;
    for (std::uint32_t c = 0; c < kCells; ++c) {
      cells.push_back(test::randomNeuron(40 + c, {.samples = 20 + 13 * (c * 7 % kCells)}));
      cells[c].name = "cell " + std::string(1, static_cast<char>('L' - c)) + "##%s";
      if (c < 10)
        cells[c].attributes = {{"kind", std::string(c % 2 != 0 ? "Basket" : "pyramid")},
                               {"layer", std::int64_t{c % 4}}};
    }
    CellList stream(std::move(cells));
    ingest(stream, folder_ / "a.fil", {.capacity = 40});
    set_ = TileSet::open(folder_ / "a.fil");
    attributes_ = std::make_shared<CellAttributes>(*set_);
  }
  void listed(CellTable& table) {
    table.serve();
    serveUntil(table, [&] { return !table.isListing(); });
  }
  std::vector<std::uint32_t> rows(CellTable& table, const CellTable::Order& order) {
    table.setOrder(order);
    listed(table);
    return table.rows();
  }

  test::TempFolder folder_;
  std::unique_ptr<TileSet> set_;
  std::shared_ptr<const CellAttributes> attributes_;
};

using Ids = std::vector<std::uint32_t>;

TEST_F(TableOfCells, SortsByEveryKindOfColumnWithMissingValuesLast) {
  CellTable table(*set_, attributes_);
  EXPECT_TRUE(table.rows().empty());
  table.open();
  listed(table);
  EXPECT_EQ(table.cells(), kCells);
  Ids by_name(kCells);
  std::iota(by_name.rbegin(), by_name.rend(), 0U);
  EXPECT_EQ(table.rows(), by_name);
  EXPECT_EQ(table.text(11, 0), "cell A##%s");
  const std::size_t layer = columnNamed(table, "layer"), kind = columnNamed(table, "kind");
  EXPECT_EQ(rows(table, {layer, false, {}}), (Ids{0, 4, 8, 1, 5, 9, 2, 6, 3, 7, 10, 11}));
  EXPECT_EQ(rows(table, {layer, true, {}}), (Ids{3, 7, 2, 6, 1, 5, 9, 0, 4, 8, 10, 11}));
  EXPECT_EQ(rows(table, {kind, false, {}}), (Ids{1, 3, 5, 7, 9, 0, 2, 4, 6, 8, 10, 11}));
  EXPECT_EQ(table.text(1, kind), "Basket");
  EXPECT_EQ(table.text(11, kind), "");

  // The set is small, so it is measured unasked.
  serveUntil(table, [&] { return table.isMeasured(); });
  EXPECT_EQ(table.error(), "");
  std::vector<double> lengths_um(kCells);
  Ids all(kCells);
  std::iota(all.begin(), all.end(), 0U);
  measureCells(*set_, all, {}, [&](std::uint32_t cell, const CellMeasures& m) { lengths_um[cell] = m.all.length_um; });
  Ids by_length = all;
  std::sort(by_length.begin(), by_length.end(), [&](auto a, auto b) { return lengths_um[b] < lengths_um[a]; });
  const std::size_t length = columnNamed(table, "measure:length");
  EXPECT_EQ(rows(table, {length, true, {}}), by_length);
  EXPECT_NE(table.text(0, length), "");
  const auto values = table.numbersOf(*findFeature("length"));
  ASSERT_TRUE(values);
  EXPECT_EQ(values->of_cell, lengths_um);
  EXPECT_EQ(values->unit, "um");
}

TEST_F(TableOfCells, TheFilterLooksAtNamesAndShownAttributes) {
  CellTable table(*set_, attributes_);
  table.open();
  EXPECT_EQ(rows(table, {0, false, "CELL k"}), Ids{1});
  EXPECT_EQ(table.cells(), kCells);
  EXPECT_EQ(rows(table, {0, false, "basket"}), (Ids{9, 7, 5, 3, 1}));
  EXPECT_EQ(rows(table, {0, false, "none"}), Ids{});
  table.show(columnNamed(table, "kind"), false);
  EXPECT_EQ(rows(table, {0, false, "basket"}), Ids{});
}

TEST_F(TableOfCells, MeasuresAreKeptAndClosingCancelsThem) {
  test::CountingStore slow(*set_);
  slow.delayLoads(std::chrono::milliseconds(20));
  CellTable table(slow, attributes_);
  table.open();
  ASSERT_TRUE(table.progress());
  table.close();
  EXPECT_FALSE(table.progress());
  for (int i = 0; i < 200; ++i) {
    table.serve();
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  EXPECT_FALSE(table.isMeasured());
  EXPECT_LT(slow.loads().size(), set_->tile_count());
  slow.delayLoads({});
  table.open();
  serveUntil(table, [&] { return table.isMeasured(); });
  table.close();
  const std::size_t loads = slow.loads().size();
  table.open();
  EXPECT_TRUE(table.isMeasured());
  EXPECT_FALSE(table.progress());
  EXPECT_EQ(slow.loads().size(), loads);
}

TEST_F(TableOfCells, ATileThatCannotBeReadIsOneLineAndMeasuringCanBeTriedAgain) {
  test::CountingStore failing(*set_);
  failing.failLoads(set_->tile_count() / 2, 1);
  CellTable table(failing, attributes_);
  table.open();
  serveUntil(table, [&] { return !table.progress(); });
  EXPECT_FALSE(table.isMeasured());
  EXPECT_NE(table.error().find("cannot measure the cells: "), std::string::npos) << table.error();
  EXPECT_EQ(table.error().find('\n'), std::string::npos);
  listed(table);
  EXPECT_EQ(table.rows().size(), kCells) << "the list stays";
  table.measure();
  EXPECT_EQ(table.error(), "");
  serveUntil(table, [&] { return table.isMeasured(); });
}

TEST(TableOfNoCells, IsEmpty) {
  const auto store = test::storeOf({});
  CellTable table(*store, nullptr);
  table.open();
  table.serve();
  serveUntil(table, [&] { return !table.isListing() && table.isMeasured(); });
  EXPECT_TRUE(table.rows().empty());
  EXPECT_EQ(table.error(), "");
}

}  // namespace
}  // namespace filiform::internal
