#include "viewer/window/panels/internal/contact_view.h"

#include "index/contacts/contacts.h"
#include "tests/support/scenes/counting_store.h"
#include "tests/support/scenes/memory_store.h"
#include "tests/support/scenes/random_cells.h"

#include <algorithm>
#include <chrono>
#include <functional>
#include <numeric>
#include <set>
#include <thread>

#include <gtest/gtest.h>

namespace filiform::internal {
namespace {

constexpr double kWithin_um = 4;

void serveUntilFound(ContactView& view) {
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (view.progress() && std::chrono::steady_clock::now() < until) {
    view.serve();
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  ASSERT_FALSE(view.progress());
}

std::vector<std::uint32_t> othersThan(const TileStore& store, std::uint32_t cell) {
  std::vector<std::uint32_t> others(store.cell_count());
  std::iota(others.begin(), others.end(), 0U);
  others.erase(others.begin() + cell);
  return others;
}

class ContactsOfACell : public ::testing::Test {
 protected:
  const std::unique_ptr<TileStore> store_ = test::storeOf(test::randomColumn(17, 12, 600, 30));
};

TEST_F(ContactsOfACell, AreThoseOfFindContactsWithTheirPlaces) {
  const PlaceFinder finder(*store_);
  ContactView view(*store_, finder);
  std::size_t all = 0;
  for (std::uint32_t cell = 0; cell < store_->cell_count(); ++cell) {
    view.find(cell, kWithin_um);
    serveUntilFound(view);
    EXPECT_EQ(view.error(), "");
    EXPECT_EQ(view.cell(), cell);
    std::vector<ContactSite> expected;
    findContacts(*store_, {.within_um = kWithin_um, .from = {cell}, .to = othersThan(*store_, cell)},
                 [&](const ContactSite& site) { expected.push_back(site); });
    std::stable_sort(expected.begin(), expected.end(),
                     [](const auto& a, const auto& b) { return a.distance_um < b.distance_um; });
    ASSERT_EQ(view.sites().size(), expected.size());
    ASSERT_EQ(view.marks_W() != nullptr, !expected.empty());
    all += expected.size();
    for (std::size_t i = 0; i < expected.size(); ++i) {
      const ContactView::Site& site = view.sites()[i];
      EXPECT_EQ(site.distance_um, expected[i].distance_um);
      EXPECT_LT((site.p_W - expected[i].sides[0].p_W).norm(), 1e-9);
      EXPECT_EQ((*view.marks_W())[i], site.p_W);
      // A jump across leads to the other cell's place, and back.
      const ContactView::Side& to = ContactView::across(site, cell);
      EXPECT_EQ(to.cell, expected[i].sides[1].cell);
      const ProxyPlace there = finder.at(*finder.walk(to.cell), to.cell, to.place);
      EXPECT_LT((there.p_W - expected[i].sides[1].p_W).norm(), 1e-6);
      EXPECT_EQ(ContactView::across(site, to.cell).cell, cell);
      const ContactView::Site* back = view.nearest(to.cell, there.p_W);
      ASSERT_NE(back, nullptr);
      EXPECT_EQ(back->other.cell, to.cell);
    }
    if (!expected.empty()) {
      EXPECT_EQ(view.nearest(cell, view.sites()[0].p_W)->p_W, view.sites()[0].p_W);
    }
  }
  EXPECT_GT(all, 5U);
}

TEST(ContactsOfOneCellOfMany, ReadOnlyTilesNearIt) {
  // Two bundles far from each other: cells 0 to 5 here, 6 to 11 there.
  std::vector<Cell> cells = test::randomColumn(5, 12, 600, 30);
  for (std::size_t c = 6; c < cells.size(); ++c)
    for (Vector3d& p : cells[c].positions_um) p.x() += 5000;
  const auto store = test::storeOf(std::move(cells));
  const test::CountingStore counting(*store);
  const PlaceFinder finder(counting);
  ContactView view(counting, finder);
  view.find(2, kWithin_um);
  serveUntilFound(view);
  EXPECT_EQ(view.error(), "");
  EXPECT_GT(view.sites().size(), 0U);
  const std::vector<TileId> read = counting.loads();
  for (const TileId tile : std::set<TileId>(read.begin(), read.end()))
    EXPECT_LT(store->grid().toWorld(store->entry(tile).content.lo).x(), 2500) << tile;
  EXPECT_LT(read.size(), store->tile_count());
}

TEST_F(ContactsOfACell, WhatCannotBeFoundIsOneLineAndClosingCancels) {
  test::CountingStore failing(*store_);
  const PlaceFinder finder(failing);
  ContactView view(failing, finder);
  for (TileId tile = 0; tile < failing.tile_count(); ++tile) failing.failLoads(tile, 1);
  view.find(1, kWithin_um);
  serveUntilFound(view);
  EXPECT_NE(view.error(), "");
  EXPECT_EQ(view.error().find('\n'), std::string::npos);
  EXPECT_TRUE(view.sites().empty());
  EXPECT_EQ(view.marks_W(), nullptr);
  for (TileId tile = 0; tile < failing.tile_count(); ++tile) failing.failLoads(tile, 0);
  view.find(1, 1e6);
  serveUntilFound(view);
  EXPECT_NE(view.error().find("give a smaller distance"), std::string::npos) << view.error();

  failing.delayLoads(std::chrono::milliseconds(5));
  const std::size_t before = failing.loads().size();
  view.find(1, kWithin_um);
  view.close();
  EXPECT_FALSE(view.progress());
  EXPECT_FALSE(view.cell());
  view.find(2, kWithin_um);
  serveUntilFound(view);
  EXPECT_EQ(view.cell(), 2U);
  EXPECT_GT(view.sites().size(), 0U);
  EXPECT_GT(failing.loads().size(), before);
}

TEST(ContactsWithoutNeighbours, AreNone) {
  const auto store = test::storeOf({test::randomNeuron(1)});
  const PlaceFinder finder(*store);
  ContactView view(*store, finder);
  view.find(0, kWithin_um);
  serveUntilFound(view);
  EXPECT_EQ(view.error(), "");
  EXPECT_TRUE(view.sites().empty());
  EXPECT_EQ(view.nearest(0, Vector3d::Zero()), nullptr);
}

}  // namespace
}  // namespace filiform::internal
