// Chooses stiffness, passivity controller and workspace for a device and the hand that holds it. Thread rule: functions
// without state.
#pragma once

#include "device/haptic_device.h"
#include "device/simulated/simulated_hand.h"
#include "solver/workspace/navigation.h"

#include <optional>
#include <string>

namespace filiform::internal {

// The mechanics of "sim" and "sim:HAND"; nullopt for other devices. Throws UnknownDevice for an unknown hand.
std::optional<HandParameters> handOf(const std::string& device);

struct NavigationWish {
  std::string held_device;  // see TravelDevice::heldDevice()
  double period_s = 0.001;
  double zoom_um = 300;                   // world across 0.12 m of device
  std::optional<double> stiffness_N_m{};  // none: 200, with the loose hand 50; hardware: defaultStiffness()
  std::optional<bool> passivity{};        // none: on unless the stiffness is below the bound
  double leap = 1;                        // see NavigationOptions
  std::optional<ButtonMap> buttons{};     // none: defaultButtons()
};

struct NavigationChoice {
  NavigationOptions navigation;
  // The largest stable stiffness (N/m), from the damping of the device and, if known, of the hand.
  double bound_N_m = 0;
  // The stiffness (N/m) that was wished, if the device allows less, mostStiffness(); 0: the wish was kept.
  double lowered_from_N_m = 0;

  double stiffness_N_m() const { return navigation.force.stiffness_N_m; }
  bool passivity() const { return navigation.force.passivity.on; }
};

// A wished stiffness above mostStiffness() of a device is lowered to it; simulated hands keep it. Throws UnknownDevice
// for an unknown hand.
NavigationChoice chooseNavigation(const DeviceCapabilities& can, const NavigationWish& wish);

// For the user: that the stiffness was lowered, and why. Empty if it was not.
std::string loweredNote(const NavigationChoice& choice, const DeviceCapabilities& can);

}  // namespace filiform::internal
