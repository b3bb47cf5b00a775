#include "device/haply/internal/haply_messages.h"

#include "tests/support/no_alloc_guard.h"

#include <cmath>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform::internal {
namespace {

// The example of Haply's documentation, shortened.
constexpr const char* kState = R"({"session_id":7,"inverse3":[{"device_id":"04A0","state":{"cursor_position":{"x":9}}},
 {"device_id":"049D","config":{},"state":{"cursor_position":{"x":0.01,"y":-0.12,"z":0.15},"cursor_velocity":{"y":0.2},
 "body_orientation":{"w":1,"x":0,"y":0,"z":0},"current_cursor_force":{"z":1.5},"control_domain":"cartesian"},
 "status":{"calibrated":true,"in_use":false,"power_supply":true,"ready":true,"started":true}}],
 "verse_grip":[{"device_id":"61548","state":{"button":true,"hall":0,"orientation":{"w":0,"z":2}}}]})";

TEST(HaplyMessages, ReadTheDocumentedState) {
  HaplyReading reading;
  ASSERT_TRUE(readState(kState, "049D", reading));
  EXPECT_TRUE(reading.has_device && reading.has_position && reading.has_orientation);
  EXPECT_EQ(reading.position_H, Eigen::Vector3d(0.01, -0.12, 0.15));
  EXPECT_EQ(reading.velocity_H, Eigen::Vector3d(0, 0.2, 0));
  EXPECT_EQ(reading.force_H, Eigen::Vector3d(0, 0, 1.5));
  EXPECT_EQ(reading.buttons, 1U);
  EXPECT_EQ(reading.orientation_H, (std::array<double, 4>{0, 0, 0, 1}));
  EXPECT_EQ(reading.status.ready, HaplySays::yes);
  EXPECT_EQ(reading.status.in_use, HaplySays::no);
  EXPECT_STREQ(obstacleOf(reading.status), "");
}

TEST(HaplyMessages, KeepWhatAMessageLeavesOut) {
  HaplyReading reading;
  ASSERT_TRUE(readState(kState, "049D", reading));
  ASSERT_TRUE(readState(R"({"inverse3":[{"device_id":"049D","state":{"current_cursor_force":{}}}]})", "049D", reading));
  EXPECT_TRUE(reading.has_device);
  EXPECT_FALSE(reading.has_position);
  EXPECT_EQ(reading.position_H.y(), -0.12);
  EXPECT_EQ(reading.force_H, Eigen::Vector3d::Zero());
  EXPECT_EQ(reading.status.ready, HaplySays::yes);
  ASSERT_TRUE(
      readState(R"({"inverse3":[{"state":{"cursor_position":{}},"device_id":"049D","status":{"ready":false}}]})",
                "049D", reading));
  EXPECT_TRUE(reading.has_position);
  EXPECT_EQ(reading.position_H, Eigen::Vector3d::Zero());
  EXPECT_EQ(reading.status.ready, HaplySays::no);
  EXPECT_STRNE(obstacleOf(reading.status), "");

  ASSERT_TRUE(readState(R"({"inverse3":[]})", "049D", reading));
  EXPECT_FALSE(reading.has_device);
  EXPECT_FALSE(readState("[]", "049D", reading));
  EXPECT_FALSE(readState(std::string(kState).substr(0, 300), "049D", reading));
  EXPECT_EQ(reading.position_H, Eigen::Vector3d::Zero());
}

TEST(HaplyMessages, ReadTheWirelessGripsButtons) {
  HaplyReading reading;
  ASSERT_TRUE(readState(
      R"({"wireless_verse_grip":[{"state":{"buttons":{"a":false,"b":true,"c":true},"orientation":{}}},
      {"state":{"buttons":{"a":true}}}]})",
      "049D", reading));
  EXPECT_EQ(reading.buttons, 6U);
  EXPECT_EQ(reading.orientation_H, (std::array<double, 4>{1, 0, 0, 0}));
}

TEST(HaplyMessages, ChooseTheNameOfAForceByTheVersion) {
  for (const char* version : {"3.5.0", R"({"version":"3.5"})", "v4.0", "3.10.1", "", "unknown", "3"})
    EXPECT_EQ(dialectFor(version), HaplyDialect::vector) << version;
  for (const char* version : {"3.4.9", R"({"version":"3.1.0"})", "2.7"})
    EXPECT_EQ(dialectFor(version), HaplyDialect::values) << version;
}

TEST(HaplyMessages, WriteTheDocumentedCommand) {
  std::array<char, kMostCommand> bytes{};
  const std::size_t first = writeCommand(bytes, {.id = "049D", .force_H = {0, -0.25, 1.5}}, true);
  EXPECT_EQ(nlohmann::json::parse(std::string(bytes.data(), first)), nlohmann::json::parse(R"({"session":{"configure":
    {"profile":{"name":"org.filiform:main"},"basis":{"permutation":"XYZ"}}},"inverse3":[{"device_id":"049D","commands":
    {"set_cursor_force":{"vector":{"x":0,"y":-0.25,"z":1.5}}}}]})"));
  const std::string id(kMostHaplyId, 'x');
  const double longest = -1.2345678901234567e-300;
  const Eigen::Vector3d long_H = Eigen::Vector3d::Constant(longest);
  const std::size_t second = writeCommand(bytes, {id, HaplyDialect::values, long_H, &long_H}, true);
  EXPECT_LT(second, bytes.size());
  const auto json = nlohmann::json::parse(std::string(bytes.data(), second));
  EXPECT_EQ(json.at("inverse3").at(0).at("commands").at("set_cursor_force").at("values").at("x"), longest);
  EXPECT_EQ(json.at("inverse3").at(0).at("commands").at("filiform_aim").at("position").at("z"), longest);
}

TEST(HaplyMessages, AreReadAndWrittenWithoutMemory) {
  std::array<char, kMostCommand> bytes{};
  HaplyReading reading;
  bool read = true;
  test::NoAllocGuard guard;
  for (int i = 0; i < 100; ++i) {
    read = readState(kState, "049D", reading) && read;
    writeCommand(bytes, {.id = "049D", .force_H = reading.force_H * (0.1 * i)}, i == 0);
  }
  const test::ForbiddenCalls calls = guard.calls();
  EXPECT_EQ(calls.total(), 0U) << calls.first;
  EXPECT_TRUE(read);
}

TEST(HaplyMessages, ReadAnInventory) {
  HaplyInventory inventory;
  ASSERT_TRUE(readInventory(R"({"inverse3":[{"device_id":"049D","config":{"a":[1]},"status":{"calibrated":false}},
    {"device_id":""},{"device_id":"04A0"}],"verse_grip":[{"device_id":"1"}]})",
                            inventory));
  ASSERT_EQ(inventory.devices.size(), 2U);
  EXPECT_EQ(inventory.devices[0].status.calibrated, HaplySays::no);
  EXPECT_EQ(inventory.devices[1].id, "04A0");
  EXPECT_EQ(inventory.grips, std::vector<std::string>{"1"});
  EXPECT_FALSE(readInventory("{", inventory));
}

}  // namespace
}  // namespace filiform::internal
