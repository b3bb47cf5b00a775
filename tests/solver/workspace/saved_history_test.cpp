#include "solver/workspace/saved_history.h"

#include "index/errors.h"
#include "solver/graph/graph_view.h"
#include "tests/support/scenes/memory_store.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/temp_folder.h"
#include "tests/support/variable.h"

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::storeOf;

namespace fs = std::filesystem;

std::vector<Cell> cells() {
  std::vector<Cell> made = test::randomColumn(4, 3, 300, 100);
  for (std::size_t i = 0; i < made.size(); ++i) made[i].source = "cell" + std::to_string(i) + ".swc";
  return made;
}

ProxyPlace placeIn(const TileStore& store, TileId tile, std::uint32_t segment, double t) {
  TileTable table(store.tile_count());
  const auto loaded = store.load(tile);
  table.add(*loaded);
  return GraphView(table, store.leaves(), store.grid()).placeAt(tile, loaded->segmentId(segment), t);
}

TEST(SavedHistory, LiesBesideTheUsersSettingsUnderTheSetsName) {
  {
    const test::Variable config("XDG_CONFIG_HOME", "/somewhere/conf"), home("HOME", "/home/someone");
    EXPECT_EQ(SavedHistory::pathFor("a/b/column.fil"), "/somewhere/conf/filiform/places/column.fil.json");
    EXPECT_EQ(SavedHistory::pathFor("column.fil/"), "/somewhere/conf/filiform/places/column.fil.json");
    EXPECT_EQ(SavedHistory::pathFor("x/.hid den\n"), "/somewhere/conf/filiform/places/%2Ehid%20den%0A.json");
    for (const char* none : {"", ".", "/", ".."}) EXPECT_THROW(SavedHistory::pathFor(none), UsageError) << none;
  }
  const test::Variable config("XDG_CONFIG_HOME", "relative"), home("HOME", "/home/someone");
  EXPECT_EQ(SavedHistory::pathFor("c.fil"), "/home/someone/.config/filiform/places/c.fil.json");
  const test::Variable no_home("HOME", std::nullopt);
  EXPECT_THROW(SavedHistory::pathFor("c.fil"), UsageError);
}

TEST(SavedHistory, PlacesSurviveAnotherIngest) {
  const test::TempFolder folder;
  const std::string path = folder / "conf/filiform/places/c.json";
  const auto fine = storeOf(cells(), 16);
  std::vector<ProxyPlace> places;
  {
    SavedHistory saved(*fine, path);
    EXPECT_TRUE(saved.warning().empty());
    EXPECT_TRUE(saved.history().places().empty());
    for (TileId tile = 0; tile < fine->tile_count(); tile += 5)
      places.push_back(placeIn(*fine, tile, tile % fine->load(tile)->segment_count(), tile % 3 == 0 ? 1.0 : 0.25));
    for (std::size_t i = 0; i + 1 < places.size(); ++i)
      saved.history().jump(i == 0 ? ProxyPlace{} : places[i - 1], places[i]);
    saved.history().setBookmark("soma \"quoted\"\n", places.back());
    saved.history().back(saved.history().places().back());
    saved.save();
  }
  ASSERT_GT(places.size(), 5u);
  // Another tile capacity, and a new first cell: tile ids and cell numbers change.
  std::vector<Cell> more = cells();
  Cell first = test::randomNeuron(77, {.samples = 200});
  first.source = "a.swc";
  more.insert(more.begin(), first);
  const auto coarse = storeOf(std::move(more), 512);
  SavedHistory saved(*coarse, path);
  EXPECT_TRUE(saved.warning().empty()) << saved.warning();
  ASSERT_EQ(saved.history().places().size(), places.size() - 1);
  EXPECT_EQ(saved.history().now(), places.size() - 3);
  for (std::size_t i = 0; i + 1 < places.size(); ++i) {
    const ProxyPlace& found = saved.history().places()[i];
    EXPECT_EQ(found.p_W, places[i].p_W);
    EXPECT_EQ(found.segment.segment, places[i].segment.segment);
    EXPECT_EQ(found.segment.cell, places[i].segment.cell + 1);
    EXPECT_EQ(found.at_node, places[i].at_node);
  }
  EXPECT_EQ(saved.history().bookmark("soma \"quoted\"\n")->p_W, places.back().p_W);
}

TEST(SavedHistory, ADamagedFileIsOneWarningAndAFreshStart) {
  const test::TempFolder folder;
  const std::string path = folder / "c.json";
  const auto store = storeOf(cells(), 64);
  std::string good;
  {
    SavedHistory saved(*store, path);
    saved.history().jump({}, placeIn(*store, 0, 0, 0.5));
    saved.history().setBookmark("here", placeIn(*store, 0, 0, 0.5));
    saved.save();
    good = test::readBytes(path);
  }
  const std::vector<std::string> damaged{"",
                                         "{",
                                         "[]",
                                         "null",
                                         "17",
                                         R"({"version":1})",
                                         R"({"version":9,"now":0,"history":[],"bookmarks":{}})",
                                         R"({"version":1,"now":-1,"history":7,"bookmarks":{}})",
                                         R"({"version":1,"now":0,"history":[5],"bookmarks":{}})",
                                         R"({"version":1,"now":-5e20,"history":[],"bookmarks":{}})",
                                         R"({"version":4294967297,"now":0,"history":[],"bookmarks":{}})",
                                         R"({"version":1,"now":0,"history":[{"cell":3}],"bookmarks":{}})",
                                         std::string(2000, '['),
                                         good + "x"};
  for (std::size_t cut = 1; cut + 2 < good.size(); cut += 7) {
    test::writeBytes(path, good.substr(0, cut));
    SavedHistory saved(*store, path);
    EXPECT_NE(saved.warning().find("damaged"), std::string::npos) << cut;
    EXPECT_TRUE(saved.history().places().empty());
  }
  for (const std::string& text : damaged) {
    test::writeBytes(path, text);
    SavedHistory saved(*store, path);
    EXPECT_NE(saved.warning().find("damaged"), std::string::npos) << text;
    EXPECT_EQ(saved.warning().find('\n'), std::string::npos);
    EXPECT_TRUE(saved.history().places().empty());
    EXPECT_TRUE(saved.history().bookmarks().empty());
    EXPECT_EQ(test::readBytes(path + ".damaged"), text);
    EXPECT_FALSE(fs::exists(path));
    saved.save();
    EXPECT_TRUE(SavedHistory(*store, path).warning().empty());
  }
}

TEST(SavedHistory, KeepsBookmarksOfCellsThatAreNotThere) {
  const test::TempFolder folder;
  const std::string path = folder / "c.json";
  const auto all = storeOf(cells(), 64);
  std::vector<Cell> some = cells();
  some.erase(some.begin() + 1, some.end());
  const auto few = storeOf(std::move(some), 64);
  {
    SavedHistory saved(*all, path);
    for (TileId tile = 0; tile < all->tile_count(); ++tile)
      saved.history().setBookmark(std::to_string(tile), placeIn(*all, tile, 0, 0.5));
    saved.save();
  }
  std::size_t found = 0;
  {
    SavedHistory saved(*few, path);
    EXPECT_NE(saved.warning().find("not in this set"), std::string::npos) << saved.warning();
    found = saved.history().bookmarks().size();
    EXPECT_LT(found, all->tile_count());
    saved.save();
  }
  SavedHistory again(*all, path);
  EXPECT_TRUE(again.warning().empty());
  EXPECT_EQ(again.history().bookmarks().size(), all->tile_count());
}

TEST(SavedHistory, SaysWhereItCannotWrite) {
  const test::TempFolder folder;
  const auto store = storeOf(cells(), 64);
  test::writeBytes(folder / "file", "no folder");
  const SavedHistory below_a_file(*store, folder / "file/c.json");
  EXPECT_THROW(below_a_file.save(), IoError);
  fs::create_directories(folder / "taken.json/x");
  EXPECT_THROW(SavedHistory(*store, folder / "taken.json"), IoError);
}

// Like every output file: a symbolic link stays, and the file keeps its permissions.
TEST(SavedHistory, FollowsALinkAndKeepsPermissions) {
  const test::TempFolder folder;
  const auto store = storeOf(cells(), 64);
  test::writeBytes(folder / "real.json", R"({"version":1,"now":0,"history":[],"bookmarks":{}})");
  fs::permissions(folder / "real.json", fs::perms::owner_read | fs::perms::owner_write);
  fs::create_symlink("real.json", folder / "c.json");
  SavedHistory saved(*store, folder / "c.json");
  saved.history().setBookmark("here", placeIn(*store, 0, 0, 0.5));
  saved.save();
  EXPECT_TRUE(fs::is_symlink(folder / "c.json"));
  EXPECT_NE(test::readBytes(folder / "real.json").find("here"), std::string::npos);
  EXPECT_EQ(fs::status(folder / "real.json").permissions(), fs::perms::owner_read | fs::perms::owner_write);
}

TEST(NavigationHistory, RestoresPlacesAndPosition) {
  const auto store = storeOf(cells(), 64);
  std::vector<ProxyPlace> places;
  for (std::uint32_t i = 0; i < 6; ++i) places.push_back(placeIn(*store, 0, i, 0.5));
  places.insert(places.begin() + 2, ProxyPlace{});  // invalid
  NavigationHistory history(4);
  history.restore(places, 3);
  EXPECT_LE(history.places().size(), 4u);
  EXPECT_EQ(history.places()[history.now()].p_W, places[3].p_W);
  history.restore(places, 99);
  EXPECT_EQ(history.now(), 3u);
  EXPECT_EQ(history.places().back().p_W, places.back().p_W);
  history.restore({}, 5);
  EXPECT_EQ(history.now(), 0u);
  EXPECT_FALSE(history.back({}));
}

}  // namespace
}  // namespace filiform
