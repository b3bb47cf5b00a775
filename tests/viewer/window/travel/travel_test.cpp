#include "viewer/window/travel/internal/travel.h"

#include "device/factory/device_factory.h"
#include "device/simulated/null_device.h"
#include "index/errors.h"
#include "index/ingest/memory_tiles.h"
#include "tests/support/scenes/counting_store.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/temp_folder.h"
#include "viewer/window/travel/internal/bookmarks.h"
#include "viewer/window/travel/internal/started_session.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <thread>

#include <gtest/gtest.h>

namespace filiform::internal {
namespace {

// A device that can be unplugged.
struct Plug {
  std::atomic<bool> in{true};
  std::atomic<bool> slow{false}, opening{false};  // open() waits while slow; it is under way
  std::atomic<int> opened{0}, asked{0};
  std::atomic<int> mice_refused{0};  // number of sessions with the mouse that still fail
};

// A disk that can stop answering.
class SilentStore : public test::CountingStore {
 public:
  explicit SilentStore(std::unique_ptr<TileStore> store) : CountingStore(*store), store_(std::move(store)) {}
  CellDetail loadCellDetail(std::uint32_t id) const override {
    while (silent) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return CountingStore::loadCellDetail(id);
  }
  std::atomic<bool> silent{false};

 private:
  std::unique_ptr<TileStore> store_;
};

class PluggedDevice : public NullDevice {
 public:
  explicit PluggedDevice(Plug& plug) : plug_(plug) {}
  void open() override {
    if (!plug_.in) throw DeviceError("it is not plugged in");
    plug_.opening = true;
    while (plug_.slow) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    plug_.opening = false;
    ++plug_.opened;
    NullDevice::open();
  }
  DeviceState exchange(const Wrench& wrench) noexcept override {
    if (!plug_.in) setStatus(DeviceStatus::fault);
    return NullDevice::exchange(wrench);
  }

 private:
  Plug& plug_;
};

class Travels : public testing::Test {
 protected:
  void SetUp() override { begin("plugged"); }
  void begin(const std::string& device, const std::string& awaited = "") {
    travel_.reset();
    CellList stream(test::randomColumn(11, 4, 400, 200));
    Opened opened;
    auto disk = std::make_unique<SilentStore>(buildTilesInMemory(stream, {.capacity = 64}));
    disk_ = disk.get();
    opened.scene.store = std::move(disk);
    opened.saved = std::make_unique<SavedHistory>(*opened.scene.store, places_);
    opened.scene.in_memory = true;
    opened.finder = std::make_unique<PlaceFinder>(*opened.scene.store);
    opened.start = opened.finder->nearest({10, 20, 30})->place;
    SessionOptions options;
    options.device = device;
    options.make_device = [this](const std::string& name, double period_s) -> std::unique_ptr<HapticDevice> {
      if (name != "plugged" && plug_.mice_refused-- > 0) throw DeviceError("no mouse today");
      if (name != "plugged") return makeDevice(name, {.period_s = period_s});
      return std::make_unique<PluggedDevice>(plug_);
    };
    Travel::Callbacks callbacks{[] {}, [](const std::string&) {},
                                [this](const std::string& asked) {
                                  EXPECT_EQ(asked, "plugged");
                                  ++plug_.asked;
                                  return plug_.in.load();
                                },
                                awaited};
    opened.options = fitTo(opened.scene, options);
    opened.session = startSession(*opened.scene.store, opened.options).get();
    travel_ = std::make_unique<Travel>(std::move(opened), messages_, callbacks);
    name_ = travel_->session().deviceName();
    travel_->start();
  }
  // Runs frames until this device is in use.
  bool comesTo(const std::string& device) {
    for (int i = 0; i < 30'000; ++i) {
      travel_->serve();
      if (travel_->session().deviceName() == device && travel_->now().place.valid()) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return false;
  }

  std::vector<std::string> savedBookmarks() const {
    return SavedHistory(travel_->store(), places_).history().bookmarks();
  }

  Plug plug_;  // outlives the rest
  test::TempFolder folder_;
  std::string places_ = folder_ / "places.json";
  SilentStore* disk_ = nullptr;
  Messages messages_;
  std::unique_ptr<Travel> travel_;
  std::string name_;
};

TEST_F(Travels, ALostDeviceIsReplacedByTheMouseAndTakenBackWhenItIsPluggedInAgain) {
  ASSERT_TRUE(comesTo(name_));
  EXPECT_EQ(plug_.asked, 0);
  for (int turn = 1; turn <= 2; ++turn) {
    const Vector3d place_W = travel_->now().p_W;
    plug_.in = false;
    ASSERT_TRUE(comesTo("mouse")) << turn;
    EXPECT_LT((travel_->now().p_W - place_W).norm(), 1) << turn;
    messages_ = {};
    plug_.in = true;
    ASSERT_TRUE(comesTo(name_)) << turn;
    EXPECT_EQ(plug_.opened, turn + 1);
    const std::vector<std::string> told = messages_.shown();
    EXPECT_EQ(std::count(told.begin(), told.end(), name_ + " is connected again"), 1) << turn;
  }
}

TEST_F(Travels, AnAwaitedDeviceReplacesTheMouseWhenItIsPluggedIn) {
  const std::string name = name_;
  plug_.in = false;
  begin("mouse", "plugged");
  ASSERT_TRUE(comesTo("mouse"));
  const Vector3d place_W = travel_->now().p_W;
  plug_.in = true;
  ASSERT_TRUE(comesTo(name));
  EXPECT_LT((travel_->now().p_W - place_W).norm(), 1);
  const std::vector<std::string> told = messages_.shown();
  EXPECT_EQ(std::count(told.begin(), told.end(), name + " is connected"), 1);
}

TEST_F(Travels, ASessionWithTheMouseThatCannotBeMadeIsTriedAgain) {
  ASSERT_TRUE(comesTo(name_));
  plug_.mice_refused = 1;
  plug_.in = false;
  EXPECT_TRUE(comesTo("mouse"));
  const std::vector<std::string> told = messages_.shown();
  EXPECT_EQ(std::count(told.begin(), told.end(), "no mouse today"), 1);
}

TEST_F(Travels, PlacesAreSavedBesideTheFrames) {
  ASSERT_TRUE(comesTo(name_));
  disk_->silent = true;
  std::atomic<bool> over{false};
  std::thread later([&] {  // ends the test if a frame waits for the disk
    for (int i = 0; i < 5000 && !over; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    disk_->silent = false;
  });
  Bookmarks(*travel_, messages_).set("a");
  for (const std::uint64_t tick = travel_->now().tick; travel_->now().tick < tick + 20;) travel_->serve();
  EXPECT_TRUE(disk_->silent);
  over = true;
  later.join();
  for (int i = 0; i < 30'000 && !travel_->isIdle(); ++i) {
    travel_->serve();
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_EQ(savedBookmarks(), std::vector<std::string>{"a"});
}

TEST_F(Travels, TheEndSavesPlacesOrTellsWhyNot) {
  ASSERT_TRUE(comesTo(name_));
  Bookmarks(*travel_, messages_).set("a");
  travel_->finish();
  EXPECT_EQ(savedBookmarks(), std::vector<std::string>{"a"});
  EXPECT_EQ(SavedHistory(travel_->store(), places_).history().places().size(), 1u);
  travel_->finish();
}

TEST_F(Travels, BookmarksAreDeletedUndoneAndComeBackFromATable) {
  ASSERT_TRUE(comesTo(name_));
  Bookmarks bookmarks(*travel_, messages_);
  const auto names = [&] { return travel_->history().bookmarks(); };
  const auto rest = [&] {
    for (int i = 0; i < 30'000 && !travel_->isIdle(); ++i) {
      travel_->serve();
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  };
  bookmarks.set("first bouton");
  bookmarks.set("b");
  const ProxyPlace place = *travel_->history().bookmark("b");
  std::string csv;
  bookmarks.write([&](std::string text) { csv = std::move(text); });
  rest();
  EXPECT_NE(csv.find("first bouton," + travel_->cellName()), std::string::npos) << csv;
  bookmarks.remove("b");
  EXPECT_EQ(names(), std::vector<std::string>{"first bouton"});
  bookmarks.undo();
  EXPECT_EQ(names(), (std::vector<std::string>{"b", "first bouton"}));
  bookmarks.remove("b");
  bookmarks.remove("first bouton");
  bookmarks.read(csv);
  rest();
  EXPECT_EQ(names(), (std::vector<std::string>{"b", "first bouton"}));
  EXPECT_LT((travel_->history().bookmark("b")->p_W - place.p_W).norm(), 1e-3);
  bookmarks.undo();
  EXPECT_TRUE(names().empty()) << "reading a table is one change";
  bookmarks.read("no table");
  rest();
  EXPECT_NE(messages_.last().find("no column name"), std::string::npos) << messages_.last();
  for (int i = 0; i < 5; ++i) bookmarks.undo();
  EXPECT_TRUE(names().empty());
  EXPECT_FALSE(bookmarks.canUndo());
}

TEST_F(Travels, TheEndTellsWhereItCannotSave) {
  ASSERT_TRUE(comesTo(name_));
  std::filesystem::create_directories(places_ + "/x");
  EXPECT_THROW(travel_->finish(), IoError);
}

// Frames and the mouse go on while the device is opened.
TEST_F(Travels, AReturningDeviceThatOpensSlowlyHoldsNothingUp) {
  ASSERT_TRUE(comesTo(name_));
  plug_.in = false;
  ASSERT_TRUE(comesTo("mouse"));
  plug_.slow = true;
  plug_.in = true;
  std::uint64_t tick = 0;
  for (int i = 0; i < 30'000 && (!plug_.opening || travel_->now().tick < tick + 20); ++i) {
    travel_->serve();
    if (!plug_.opening) tick = travel_->now().tick;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_TRUE(plug_.opening);
  EXPECT_EQ(travel_->session().deviceName(), "mouse");
  EXPECT_GE(travel_->now().tick, tick + 20);
  plug_.slow = false;
  EXPECT_TRUE(comesTo(name_));
}

TEST(Closings, EndOneAfterTheOtherAndTellWhatFailed) {
  std::atomic<bool> goes_on{false};
  std::vector<int> order;
  Closing closing;
  closing.begin([&] {
    while (!goes_on) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    order.push_back(1);
    throw InputError("the first");
  });
  closing.begin([&] { order.push_back(2); });
  EXPECT_TRUE(closing.isUnderWay());
  EXPECT_TRUE(closing.takeFailures().empty());
  goes_on = true;
  for (int i = 0; i < 30'000 && closing.isUnderWay(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_EQ(closing.takeFailures(), std::vector<std::string>{"the first"});
  EXPECT_EQ(order, (std::vector<int>{1, 2}));
}

}  // namespace
}  // namespace filiform::internal
