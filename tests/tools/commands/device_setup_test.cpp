// `filiform devices --setup` walked through with a simulated Haply service and a bridge to a device with one button.
#include "device/bridge/bridge_device.h"
#include "device/haply/haply_device.h"
#include "device/haply/simulated_haply.h"
#include "device/haply/simulated_haply_server.h"
#include "solver/workspace/button_map.h"
#include "tests/support/devices/bridge_process.h"
#include "tests/support/process.h"
#include "tests/support/servers/started_process.h"
#include "tests/support/temp_folder.h"
#include "tests/support/variable.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <thread>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform::tools {
namespace {

using test::Outcome;
using test::runFiliform;

SimulatedHaplyOptions ledService(bool is_wireless, bool is_mirrored) {
  SimulatedHaplyOptions options;
  options.is_led = true;
  options.is_wireless = is_wireless;
  options.is_mirrored = is_mirrored;
  options.clock = [begin = std::chrono::steady_clock::now()] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  };
  return options;
}

// A service whose person presses the grip's buttons one after the other.
struct HeldGrip {
  explicit HeldGrip(bool is_wireless, bool is_mirrored = false) : service(ledService(is_wireless, is_mirrored)) {}
  ~HeldGrip() {
    ends = true;
    presses.join();
  }
  test::TempFolder folder;
  test::Variable config{"XDG_CONFIG_HOME", folder.path()};
  SimulatedHaply service;
  SimulatedHaplyServer server{service};
  test::Variable variable{kHaplyServiceVariable, "127.0.0.1:" + std::to_string(server.port())};
  std::atomic<bool> ends{false};
  std::thread presses{[this] {
    for (std::uint32_t i = 0; !ends; ++i) {
      service.faults().buttons = 1U << i % 3;
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
      service.faults().buttons = 0;
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
  }};
};

TEST(DeviceSetup, AGripWithOneButtonGetsADefaultThatCanDoAll) {
  const HeldGrip grip(false);
  const Outcome setup = runFiliform({"devices", "--setup", "haply"}, "\n");
  EXPECT_EQ(setup.exit_code, 0) << setup.err;
  EXPECT_EQ(setup.out, "Haply Inverse3 049D: 0=mode-turn; saved in " + buttonsFile() +
                           "\nnow travel: filiform view SCENE --device haply\n");
  for (const char* const line : {"push the handle 3 cm to the right, then let it come back\n", "3 cm up",
                                 "3 cm towards you", "press a button\n", "action of button 0 [mode-turn]: "})
    EXPECT_NE(setup.err.find(line), std::string::npos) << line << setup.err;
  EXPECT_EQ(savedButtons("Haply Inverse3 049D"), (ButtonMap{ButtonAction::mode_turn}));
}

TEST(DeviceSetup, EachMistakeGetsOneLine) {
  const HeldGrip grip(true);
  const Outcome setup = runFiliform({"devices", "--setup"}, "fly\nnone\n\nzoom-in\n");
  EXPECT_EQ(setup.exit_code, 0) << setup.err;
  EXPECT_NE(setup.err.find("'fly' is no action; choose one of mode, centre, zoom-in, "), std::string::npos)
      << setup.err;
  const std::optional<ButtonMap> saved = savedButtons("Haply Inverse3 049D");
  ASSERT_TRUE(saved);
  EXPECT_EQ(std::count(saved->begin(), saved->end(), ButtonAction::zoom_in), 1) << setup.out;
  std::ofstream(buttonsFile()) << "{";
  const Outcome damaged = runFiliform({"devices", "--setup"}, "\n\n\n");
  EXPECT_TRUE(damaged.oneLineOnStderr()) << damaged.err;
  EXPECT_EQ(damaged.exit_code, 1);
  EXPECT_NE(damaged.err.find("buttons.json: is damaged: remove it, then run filiform devices --setup again\n"),
            std::string::npos)
      << damaged.err;
}

TEST(DeviceSetup, AMirroredHandIsNoticed) {
  const HeldGrip grip(true, true);
  const std::string line =
      "Haply Inverse3 049D: pushed to the right, the handle was seen to go to the left: set handedness and mount in "
      "the "
      "Haply Inverse Service";
  const Outcome setup = runFiliform({"devices", "--setup"});
  EXPECT_EQ(setup.exit_code, 3);
  EXPECT_NE(setup.err.find(line + "\n"), std::string::npos) << setup.err;
  EXPECT_FALSE(savedButtons("Haply Inverse3 049D"));
  const Outcome test = runFiliform({"devices", "--test", "haply"});
  EXPECT_EQ(test.exit_code, 0) << test.err;
  EXPECT_NE(test.out.find("  wrong    " + line), std::string::npos) << test.out;
}

TEST(DeviceSetup, TheSettingsOfTheServiceAreShown) {
  const HeldGrip grip(true);
  const Outcome list = runFiliform({"devices"});
  EXPECT_NE(list.out.find(R"(  settings handedness "right", preset "arm_front_centered", damping {"scalar":0}, )"
                          "gravity_compensation true\n"),
            std::string::npos)
      << list.out;
}

TEST(DeviceSetup, ABridgeWithOneButtonIsSetUp) {
  const test::TempFolder folder;
  const test::Variable config("XDG_CONFIG_HOME", folder.path());
  const std::string device = "bridge:" + (folder / "b");
  const test::StartedProcess bridge({test::bridgeProgram("one_button"), folder / "b"});
  const Outcome setup = runFiliform({"devices", "--setup", device}, "turn\n");
  EXPECT_EQ(setup.exit_code, 0) << setup.err;
  EXPECT_EQ(savedButtons("one-button (bridge)"), (ButtonMap{ButtonAction::turn})) << setup.out;
  const Outcome none = runFiliform({"devices", "--setup", "bridge:" + (folder / "none")});
  EXPECT_EQ(none.exit_code, 3);
  EXPECT_TRUE(none.oneLineOnStderr()) << none.err;
}

TEST(DeviceSetup, ABridgeThatTurnsItsAxesIsNoticed) {
  const test::TempFolder folder;
  const test::StartedProcess bridge({test::bridgeProgram("one_button"), folder / "b", "mirrored"});
  const Outcome setup = runFiliform({"devices", "--setup", "bridge:" + (folder / "b")});
  EXPECT_EQ(setup.exit_code, 3);
  EXPECT_NE(setup.err.find("pushed to the right, the handle was seen to go to the left: see how the device stands"),
            std::string::npos)
      << setup.err;
}

TEST(DeviceSetup, ABridgeWithAWrongDescriptionDoesNotStart) {
  const std::pair<const char*, const char*> wrongs[] = {
      {"stiff", "needs a greatest stiffness of 0 to 1000000 N/m"},
      {"nan", "needs a peak force of 0 to 1000 N"},
      {"flat", "needs a workspace at least 1 mm wide, and within 10 m"}};
  for (const auto& [how, why] : wrongs) {
    const test::TempFolder folder;
    EXPECT_THROW(test::StartedProcess({test::bridgeProgram("one_button"), folder / "b", how}, folder / "err"),
                 std::runtime_error);
    std::ostringstream said;
    said << std::ifstream(folder / "err").rdbuf();
    EXPECT_EQ(said.str(), std::string("bridge: one-button: ") + why + "\n");
  }
}

}  // namespace
}  // namespace filiform::tools
