// `filiform devices` and `navigate` with a simulated Haply service.
#include "device/check/found_devices.h"
#include "device/haply/haply_device.h"
#include "device/haply/simulated_haply.h"
#include "device/haply/simulated_haply_server.h"
#include "solver/loop/device_test.h"
#include "tests/support/devices/device_route.h"
#include "tests/support/devices/fake_usb.h"
#include "tests/support/process.h"
#include "tests/support/servers/started_process.h"
#include "tests/support/temp_folder.h"
#include "tests/support/variable.h"
#include "tools/words/device_report.h"

#include <csignal>
#include <fstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform::tools {
namespace {

using test::Outcome;
using test::runFiliform;

struct ServiceHere {
  SimulatedHaply service;
  SimulatedHaplyServer server{service};
  test::Variable variable{kHaplyServiceVariable, "127.0.0.1:" + std::to_string(server.port())};
};

nlohmann::json devicesJson() {
  const Outcome outcome = runFiliform({"devices", "--json"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  return nlohmann::json::parse(outcome.out);
}

TEST(HaplyDevices, TheServiceAndItsDevicesAreListed) {
  ServiceHere here;
  nlohmann::json json = devicesJson();
  EXPECT_EQ(json.at("haply_service").at("state"), "running");
  EXPECT_TRUE(json.at("haply_service").at("remedy").is_null());
  EXPECT_EQ(json.at("devices").back().at("device"), "haply,049D");
  EXPECT_EQ(json.at("devices").back().at("state"), "ready");

  here.service.faults().calibrated = false;
  const Outcome text = runFiliform({"devices"});
  EXPECT_NE(text.out.find("use      --device haply,049D\n  state    not_calibrated"), std::string::npos) << text.out;
  EXPECT_NE(text.out.find("calibrate it as its manual says"), std::string::npos) << text.out;
}

TEST(HaplyDevices, AServiceThatDoesNotRunIsSaidWithItsRemedy) {
  std::uint16_t port = 0;
  {
    const ServiceHere here;
    port = here.server.port();
  }
  const test::Variable variable(kHaplyServiceVariable, "127.0.0.1:" + std::to_string(port));
  const nlohmann::json json = devicesJson();
  const Outcome text = runFiliform({"devices"});
  EXPECT_EQ(json.at("haply_service").at("state"), "not running");
  EXPECT_NE(json.at("haply_service").at("remedy").get<std::string>().find("systemctl start"), std::string::npos);
  EXPECT_NE(text.out.find(": not running\n"), std::string::npos) << text.out;
  EXPECT_NE(text.out.find("systemctl start haply-inverse-service"), std::string::npos) << text.out;
}

TEST(HaplyDevices, IsPluggedInAsksTheService) {
  ServiceHere here;
  test::FakeUsb usb;
  EXPECT_TRUE(isPluggedIn(usb, "haply"));
  EXPECT_TRUE(isPluggedIn(usb, "haply,049D"));
  EXPECT_FALSE(isPluggedIn(usb, "haply,0000"));
}

TEST(HaplyDevices, TheLongTestWritesAReport) {
  ServiceHere here;
  const test::TempFolder folder;
  HaplyDevice haply(haplyOptions(""));
  DeviceCheckOptions options{.read_s = 0.05, .ramp_s = 0.1};
  options.walk = DeviceWalkOptions{
      .workspace_s = 0.1, .gravity_s = 0.05, .spring_s = 0.1, .damping_s = 0.1, .sweep_s = 0.1, .pause_s = 0.02};
  std::string told;
  options.tell = [&told](const std::string& text) { told += text + '\n'; };
  const DeviceCheck check = checkDevice(haply, options);
  ASSERT_TRUE(check.walk);
  EXPECT_LE(here.service.strongest_N(), options.walk->force_N + 1e-9);
  EXPECT_NE(told.find("workspace:"), std::string::npos) << told;
  EXPECT_NE(told.find("the force is off"), std::string::npos) << told;
  const nlohmann::json report = nlohmann::json::parse(deviceReport("haply:lab-7:99,049D", haply, check).dump());
  EXPECT_EQ(report.at("format"), "filiform.device-report");
  EXPECT_EQ(report.at("device"), "haply");
  EXPECT_EQ(report.at("transport").at("dialect"), "vector");
  EXPECT_GT(report.at("transport").at("period_s"), 0);
  EXPECT_EQ(report.at("walk").at("springs").size(), 3U);
  EXPECT_GE(report.at("walk").at("sweep").size(), 1U);
  EXPECT_EQ(report.dump().find("lab-7"), std::string::npos);
}

TEST(HaplyDevices, TheProgramWritesTheReportOfASimulatedHand) {
  const test::TempFolder folder;
  const std::string path = folder.file("report.json");
  const Outcome outcome = runFiliform({"devices", "--test", "sim:medium", "--report", path});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("  sweep    25 stable; 50 stable; 100 stable; 200 stable; N/m"), std::string::npos)
      << outcome.out;
  EXPECT_NE(outcome.err.find("stability:"), std::string::npos) << outcome.err;
  std::ifstream file(path);
  const nlohmann::json report = nlohmann::json::parse(file);
  EXPECT_EQ(report.at("device"), "sim");
  EXPECT_TRUE(report.at("transport").is_null());
  EXPECT_NEAR(report.at("walk").at("springs").at(0).at("force_N"), 0.4, 0.05);
  EXPECT_EQ(runFiliform({"devices", "--report", path}).exit_code, 2);
}

TEST(HaplyDevices, ARunThroughTheServiceIsReplayedIdentically) {
  ServiceHere here;
  const test::TempFolder folder;
  const std::string cell = folder.file("cell.swc"), record = folder.file("run.rec");
  test::writeBytes(cell, "1 1 0 0 0 5 -1\n2 3 100 0 0 1 1\n3 3 200 10 0 1 2\n");
  const std::string live = folder.file("live.csv"), replayed = folder.file("replayed.csv");
  const Outcome run = runFiliform({"navigate", cell, "--device", "haply", "--realtime", "--seconds", "1", "--stiffness",
                                   "900", "--record", record, "--csv", live});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.err.find("stiffness lowered from 900 to "), std::string::npos) << run.err;
  const Outcome replay = runFiliform({"navigate", cell, "--device", "replay:" + record, "--csv", replayed});
  EXPECT_EQ(replay.exit_code, 0) << replay.err;
  EXPECT_GT(test::readBytes(live).size(), 1000U);
  EXPECT_EQ(test::readBytes(replayed), test::readBytes(live));
}

TEST(HaplyDevices, ARouteIsTravelledThroughASimulatedServiceAndReplayedIdentically) {
  test::StartedProcess service({test::filiformProgram(), "devices", "--simulate-haply", "0"});
  const std::string said = "simulated Haply Inverse Service: use --device ";
  ASSERT_TRUE(service.line().starts_with(said + "haply:127.0.0.1:")) << service.line();
  const std::string device = service.line().substr(said.size());
  const test::Variable variable(kHaplyServiceVariable, device.substr(6));
  EXPECT_EQ(devicesJson().at("devices").back().at("state"), "ready");
  test::expectRouteAndReplay(device);
  service.signal(SIGTERM);
  EXPECT_EQ(service.wait(), 0);
}

TEST(HaplyDevices, ASimulatedServiceSaysWhyItCannotListen) {
  const test::StartedProcess first({test::filiformProgram(), "devices", "--simulate-haply", "0"});
  const std::string port = first.line().substr(first.line().rfind(':') + 1);
  const Outcome second = runFiliform({"devices", "--simulate-haply", port});
  EXPECT_EQ(second.exit_code, 3);
  EXPECT_TRUE(second.oneLineOnStderr()) << second.err;
  EXPECT_NE(second.err.find("cannot listen on port " + port), std::string::npos) << second.err;
  EXPECT_EQ(runFiliform({"devices", "--simulate-haply", "70000"}).exit_code, 2);
  EXPECT_EQ(runFiliform({"devices", "--simulate-haply", "0", "--json"}).exit_code, 2);
}

}  // namespace
}  // namespace filiform::tools
