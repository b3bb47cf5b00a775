// The program with the simulated bridge of tools/bridges.
#include "tests/support/devices/bridge_process.h"
#include "tests/support/devices/device_route.h"
#include "tests/support/process.h"
#include "tests/support/temp_folder.h"
#include "tests/support/variable.h"

#include <csignal>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform::tools {
namespace {

using test::BridgeProcess;
using test::Outcome;
using test::runFiliform;

TEST(BridgeCommand, NavigateTravelsARouteThroughABridgeAndReplaysItToTheByte) {
  const test::TempFolder folder;
  BridgeProcess bridge(folder / "b");
  test::expectRouteAndReplay("bridge:" + (folder / "b"));
}

TEST(BridgeCommand, NavigateSaysWhatABridgeNeeds) {
  const test::TempFolder folder;
  test::writeBytes(folder / "c.swc", test::straightCell());
  const Outcome absent =
      runFiliform({"navigate", folder / "c.swc", "--device", "bridge:" + (folder / "b"), "--realtime"});
  EXPECT_EQ(absent.exit_code, 3);
  EXPECT_TRUE(absent.oneLineOnStderr()) << absent.err;
  EXPECT_NE(absent.err.find("no bridge listens there"), std::string::npos) << absent.err;
  BridgeProcess bridge(folder / "b");
  const std::string device = "bridge:" + (folder / "b");
  const Outcome virtual_time = runFiliform({"navigate", folder / "c.swc", "--device", device});
  EXPECT_EQ(virtual_time.exit_code, 2);
  EXPECT_NE(virtual_time.err.find("add --realtime"), std::string::npos) << virtual_time.err;
  const Outcome stiff = runFiliform({"navigate", folder / "c.swc", "--device", device, "--realtime", "--seconds", "0.2",
                                     "--stiffness", "1500", "--json"});
  EXPECT_EQ(stiff.exit_code, 0) << stiff.err;
  EXPECT_NE(stiff.err.find("stiffness lowered from 1500 to "), std::string::npos) << stiff.err;
  EXPECT_LE(nlohmann::json::parse(stiff.out).at("stiffness_N_m"), 0.8 * 0.5 / 0.0015 + 1e-9);
}

TEST(BridgeCommand, DevicesListsBridges) {
  const test::TempFolder folder;
  const test::Variable runtime("XDG_RUNTIME_DIR", folder.path());
  {
    BridgeProcess bridge("");
    const Outcome list = runFiliform({"devices"});
    EXPECT_NE(
        list.out.find("use      --device bridge:" + (folder / "filiform/simulated.bridge") + "\n  state    ready"),
        std::string::npos)
        << list.out;
    const Outcome test = runFiliform({"devices", "--test", "bridge", "--json"});
    EXPECT_EQ(test.exit_code, 0) << test.err;
    EXPECT_GT(nlohmann::json::parse(test.out).at("test").at("force_N"), 0);
  }
  const Outcome list = runFiliform({"devices", "--json"});
  const auto devices = nlohmann::json::parse(list.out).at("devices");
  bool is_found = false;
  for (const auto& device : devices) {
    if (device.at("kind") != "bridge") continue;
    is_found = true;
    EXPECT_EQ(device.at("state"), "not_running");
    EXPECT_TRUE(device.at("bus_path").is_null());
    EXPECT_FALSE(device.at("remedy").is_null());
  }
  EXPECT_TRUE(is_found) << list.out;
}

}  // namespace
}  // namespace filiform::tools
