#include "viewer/internal/travel.h"

#include "device/device_factory.h"
#include "device/null_device.h"
#include "index/errors.h"
#include "index/memory_tiles.h"
#include "tests/support/random_cells.h"

#include <algorithm>
#include <chrono>
#include <thread>

#include <gtest/gtest.h>

namespace filiform::internal {
namespace {

// A device at a cable.
struct Plug {
  std::atomic<bool> in{true};
  std::atomic<bool> slow{false}, opening{false};  // open() waits; it does
  std::atomic<int> opened{0}, asked{0};
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
  void SetUp() override {
    CellList stream(test::randomColumn(11, 4, 400, 200));
    Opened opened;
    opened.scene.store = buildTilesInMemory(stream, {.capacity = 64});
    opened.scene.in_memory = true;
    opened.finder = std::make_unique<PlaceFinder>(*opened.scene.store);
    opened.start = opened.finder->nearest({10, 20, 30})->place;
    SessionOptions options;
    options.device = "plugged";
    options.make_device = [this](const std::string& name, double period_s) -> std::unique_ptr<HapticDevice> {
      if (name != "plugged") return makeDevice(name, {.period_s = period_s});
      return std::make_unique<PluggedDevice>(plug_);
    };
    Travel::Callbacks callbacks{[] {}, [](const std::string&) {},
                                [this](const std::string& device) {
                                  EXPECT_EQ(device, "plugged");
                                  ++plug_.asked;
                                  return plug_.in.load();
                                }};
    opened.options = fitTo(opened.scene, options);
    opened.session = std::make_unique<Session>(*opened.scene.store, opened.options);
    travel_ = std::make_unique<Travel>(std::move(opened), messages_, callbacks);
    name_ = travel_->session().deviceName();
    travel_->start();
  }
  // Frames until that device leads.
  bool comesTo(const std::string& device) {
    for (int i = 0; i < 30'000; ++i) {
      travel_->serve();
      if (travel_->session().deviceName() == device && travel_->now().place.valid()) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return false;
  }

  Plug plug_;  // outlives the rest
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
    EXPECT_EQ(std::count(told.begin(), told.end(), name_ + " is back"), 1) << turn;
  }
}

// Frames and the mouse's hand go on while it is opened.
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
