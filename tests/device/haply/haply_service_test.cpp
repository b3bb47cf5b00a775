#include "device/haply/haply_service.h"

#include "device/haply/simulated_haply.h"
#include "device/haply/simulated_haply_server.h"
#include "tests/support/variable.h"

#include <optional>

#include <gtest/gtest.h>

namespace filiform {
namespace {

HaplyOptions optionsFor(SimulatedHaply& service) {
  HaplyOptions options;
  options.connect = service.connections();
  return options;
}

TEST(HaplyService, ListsItsDevicesAndWhatTheyLack) {
  SimulatedHaplyOptions two;
  two.devices = {"049D", "04A0"};
  SimulatedHaply service(two);
  HaplyServiceState state = askHaplyService(optionsFor(service));
  EXPECT_TRUE(state.runs);
  EXPECT_EQ(state.trouble, "");
  EXPECT_NE(state.version.find("3.5.2"), std::string::npos);
  ASSERT_EQ(state.devices.size(), 2U);
  EXPECT_EQ(state.devices[1].id, "04A0");
  EXPECT_EQ(state.devices[1].state, "ready");
  EXPECT_EQ(state.devices[1].remedy, "");
  EXPECT_EQ(state.grips, std::vector<std::string>{"61548"});
  EXPECT_EQ(service.answers(), 0U);

  service.faults().ready = false;
  EXPECT_EQ(askHaplyService(optionsFor(service)).devices.at(0).state, "not_ready");
  service.faults().calibrated = false;
  state = askHaplyService(optionsFor(service));
  EXPECT_EQ(state.devices.at(0).state, "not_calibrated");
  EXPECT_NE(state.devices.at(0).remedy.find("calibrate it"), std::string::npos);
  service.faults().power = false;
  EXPECT_EQ(askHaplyService(optionsFor(service)).devices.at(0).state, "no_power");
}

TEST(HaplyService, SaysWhyItCannotBeAsked) {
  SimulatedHaply service;
  service.faults().ends = true;
  const HaplyServiceState state = askHaplyService(optionsFor(service));
  EXPECT_FALSE(state.runs);
  EXPECT_NE(state.trouble, "");
  HaplyOptions nowhere;
  {
    const SimulatedHaplyServer server(service);
    nowhere.port = server.port();
  }
  EXPECT_NE(askHaplyService(nowhere).trouble.find("refused"), std::string::npos);
}

TEST(HaplyService, TheEnvironmentNamesItsAddress) {
  {
    const test::Variable service(kHaplyServiceVariable, "lab-7:1234");
    EXPECT_EQ(haplyOptions(",049D").host, "lab-7");
    EXPECT_EQ(haplyOptions("").port, 1234);
    EXPECT_EQ(haplyOptions(":here:99").host, "here");
    const test::Variable without_port(kHaplyServiceVariable, "lab-7");
    EXPECT_THROW(haplyOptions(""), UnknownDevice);
  }
  const test::Variable none(kHaplyServiceVariable, std::nullopt);
  EXPECT_EQ(haplyOptions("").host, "127.0.0.1");
}

}  // namespace
}  // namespace filiform
