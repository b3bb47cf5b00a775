#include "solver/travel/hand/internal/navigation_choice.h"

#include "solver/force/force_law.h"

#include <gtest/gtest.h>

namespace filiform::internal {
namespace {

DeviceCapabilities simulated() {
  DeviceCapabilities can;
  can.damping_Ns_m = 0.5;
  can.delay_samples = 1;
  return can;
}

NavigationChoice choiceFor(const std::string& device, std::optional<double> stiffness_N_m = {}) {
  return chooseNavigation(simulated(), {.held_device = device, .stiffness_N_m = stiffness_N_m});
}

TEST(NavigationChoice, KnowsTheHandsByTheirNames) {
  EXPECT_FALSE(handOf("falcon"));
  EXPECT_FALSE(handOf("simulated"));
  EXPECT_EQ(handOf("sim")->damping_Ns_m, handParameters("medium").damping_Ns_m);
  EXPECT_EQ(handOf("sim:firm")->stiffness_N_m, handParameters("firm").stiffness_N_m);
  EXPECT_THROW(handOf("sim:giant"), DeviceError);
}

TEST(NavigationChoice, TheStiffnessFollowsTheHand) {
  EXPECT_EQ(choiceFor("sim:medium").stiffness_N_m(), 200);
  EXPECT_EQ(choiceFor("sim:loose").stiffness_N_m(), 50);
  EXPECT_EQ(choiceFor("sim:loose", 120).stiffness_N_m(), 120);
  DeviceCapabilities hardware = simulated();
  hardware.max_stiffness_N_m = 90;
  EXPECT_EQ(chooseNavigation(hardware, {.held_device = "falcon"}).stiffness_N_m(), defaultStiffness(hardware, 0.001));
}

TEST(NavigationChoice, AStiffnessBeyondTheDeviceIsLowered) {
  const double most_N_m = 0.8 * stiffnessBound(0.5, 0.001, 1);
  EXPECT_DOUBLE_EQ(choiceFor("bridge:x", 5000).stiffness_N_m(), most_N_m);
  EXPECT_EQ(choiceFor("bridge:x", 5000).lowered_from_N_m, 5000);
  EXPECT_EQ(choiceFor("bridge:x", 100).stiffness_N_m(), 100);
  EXPECT_EQ(choiceFor("bridge:x", 100).lowered_from_N_m, 0);
  EXPECT_EQ(choiceFor("sim:firm", 50'000).lowered_from_N_m, 0) << "a simulated hand is for trying";
  DeviceCapabilities late = simulated();
  late.delay_samples = 3;
  EXPECT_DOUBLE_EQ(chooseNavigation(late, {.held_device = "bridge:x", .stiffness_N_m = 5000}).stiffness_N_m(),
                   0.8 * 0.5 / 0.0035);
  DeviceCapabilities unknown;
  EXPECT_EQ(chooseNavigation(unknown, {.held_device = "falcon", .stiffness_N_m = 5000}).stiffness_N_m(), 5000);
}

TEST(NavigationChoice, AStiffnessAboveTheDevicesLimitIsLoweredWithANote) {
  DeviceCapabilities hardware;
  hardware.name = "a device";
  hardware.max_stiffness_N_m = 90;
  hardware.nominal_rate_Hz = 400;
  hardware.delay_samples = 2;
  NavigationChoice choice = chooseNavigation(hardware, {.held_device = "haply", .stiffness_N_m = 150.0});
  EXPECT_EQ(choice.stiffness_N_m(), 90);
  EXPECT_TRUE(choice.passivity());
  EXPECT_EQ(loweredNote(choice, hardware),
            "stiffness lowered from 150 to 90 N/m: the largest that a device renders at its rate (400 Hz) and delay (2 "
            "states)");
  choice = chooseNavigation(hardware, {.held_device = "haply", .stiffness_N_m = 90.0});
  EXPECT_EQ(choice.stiffness_N_m(), 90);
  EXPECT_EQ(loweredNote(choice, hardware), "");
}

TEST(NavigationChoice, TheControllerIsOnWhereTheStiffnessIsNotBelowTheBound) {
  const double bound_N_m = choiceFor("sim:medium").bound_N_m;
  EXPECT_DOUBLE_EQ(bound_N_m, stiffnessBound(0.5 + handParameters("medium").damping_Ns_m, 0.001, 1));
  EXPECT_FALSE(choiceFor("sim:medium", 0.99 * bound_N_m).passivity());
  EXPECT_TRUE(choiceFor("sim:medium", bound_N_m).passivity());
  NavigationWish wish{.held_device = "sim:medium"};
  wish.passivity = true;
  EXPECT_TRUE(chooseNavigation(simulated(), wish).passivity());
  wish.stiffness_N_m = 2 * bound_N_m;
  wish.passivity = false;
  EXPECT_FALSE(chooseNavigation(simulated(), wish).passivity());
}

TEST(NavigationChoice, TheWorkspaceIsTheDevicesBox) {
  DeviceCapabilities can = simulated();
  can.workspace_hi_D = {0.1, 0.2, 0.3};
  can.rate_control = true;
  const NavigationChoice choice = chooseNavigation(can, {.held_device = "sim", .zoom_um = 70});
  EXPECT_EQ(choice.navigation.workspace.hi_D, can.workspace_hi_D);
  EXPECT_EQ(choice.navigation.workspace.zoom_um, 70);
  EXPECT_TRUE(choice.navigation.rate_control);
}

TEST(NavigationChoice, TheClutchOfAStylusIsReachableAndItsModelIsSent) {
  DeviceCapabilities can = simulated();
  can.buttons = 3;
  EXPECT_EQ(chooseNavigation(can, {.held_device = "sim"}).navigation.buttons[1], ButtonAction::centre);
  EXPECT_FALSE(chooseNavigation(can, {.held_device = "sim"}).navigation.local_model);
  can.senses_orientation = can.renders_model = true;
  NavigationChoice choice = chooseNavigation(can, {.held_device = "sim"});
  EXPECT_EQ(choice.navigation.buttons[1], ButtonAction::turn);
  EXPECT_EQ(choice.navigation.buttons[0], ButtonAction::toggle_mode);
  EXPECT_TRUE(choice.navigation.has_stylus);
  EXPECT_TRUE(choice.navigation.local_model);
  can.buttons = 1;
  EXPECT_EQ(chooseNavigation(can, {.held_device = "sim"}).navigation.buttons[0], ButtonAction::mode_turn);
  const ButtonMap wished{ButtonAction::carry};
  EXPECT_EQ(chooseNavigation(can, {.held_device = "sim", .buttons = wished}).navigation.buttons, wished);
}

}  // namespace
}  // namespace filiform::internal
