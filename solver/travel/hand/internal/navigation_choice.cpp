#include "solver/travel/hand/internal/navigation_choice.h"

#include "solver/force/passivity.h"

#include <algorithm>
#include <cmath>

namespace filiform::internal {

std::optional<HandParameters> handOf(const std::string& device) {
  if (device != "sim" && device.rfind("sim:", 0) != 0) return std::nullopt;
  return handParameters(device.size() > 4 ? device.substr(4) : "medium");
}

NavigationChoice chooseNavigation(const DeviceCapabilities& can, const NavigationWish& wish) {
  const std::optional<HandParameters> hand = handOf(wish.held_device);
  const double damping_Ns_m = can.damping_Ns_m + (hand ? hand->damping_Ns_m : 0.0);
  NavigationChoice choice;
  choice.bound_N_m = stiffnessBound(damping_Ns_m, wish.period_s, can.delay_samples);
  NavigationOptions& navigation = choice.navigation;
  const double most_N_m = mostStiffness(can, wish.period_s);
  if (!hand && wish.stiffness_N_m && *wish.stiffness_N_m > most_N_m) {
    navigation.force.stiffness_N_m = most_N_m;
    choice.lowered_from_N_m = *wish.stiffness_N_m;
  } else if (wish.stiffness_N_m)
    navigation.force.stiffness_N_m = *wish.stiffness_N_m;
  else if (hand)
    navigation.force.stiffness_N_m = wish.held_device == "sim:loose" ? 50.0 : 200.0;
  else
    navigation.force.stiffness_N_m = defaultStiffness(can, wish.period_s);
  navigation.force.passivity.on = wish.passivity.value_or(choice.stiffness_N_m() >= choice.bound_N_m);
  navigation.force.passivity.delay_samples = std::clamp(can.delay_samples, 0, PassivityOptions::kMaxDelay);
  navigation.workspace.lo_D = can.workspace_lo_D;
  navigation.workspace.hi_D = can.workspace_hi_D;
  navigation.workspace.zoom_um = wish.zoom_um;
  navigation.leap = wish.leap;
  navigation.rate_control = can.rate_control;
  navigation.local_model = can.renders_model;
  navigation.has_stylus = can.senses_orientation;
  navigation.buttons = wish.buttons.value_or(defaultButtons(can));
  return choice;
}

std::string loweredNote(const NavigationChoice& choice, const DeviceCapabilities& can) {
  if (choice.lowered_from_N_m == 0) return {};
  return "stiffness lowered from " + std::to_string(std::lround(choice.lowered_from_N_m)) + " to " +
         std::to_string(std::lround(choice.stiffness_N_m())) + " N/m: the largest that " + can.name +
         " renders at its rate (" + std::to_string(std::lround(can.nominal_rate_Hz)) + " Hz) and delay (" +
         std::to_string(can.delay_samples) + " states)";
}

}  // namespace filiform::internal
