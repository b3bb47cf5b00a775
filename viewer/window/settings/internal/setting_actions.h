// The actions that change a setting: colours, stereo, projection, panels. Thread rule: one owner.
#pragma once

#include "viewer/window/settings/bindings.h"
#include "viewer/window/settings/internal/messages.h"
#include "viewer/window/settings/settings.h"

namespace filiform::internal {

// Changes the setting that belongs to the action, and says its new value if the window does not show it otherwise.
// Without `has_quad_buffer`, quad-buffer stereo is skipped. False: the action belongs to no setting.
bool changeSetting(Action action, bool has_quad_buffer, Settings& settings, Messages& messages);

// Adds to the eye separation, within 0 .. 2, and says the new value.
void changeSeparation(double by, Settings& settings, Messages& messages);
inline constexpr double kSeparationStep = 0.1;  // for one press of a key or one notch of the wheel

}  // namespace filiform::internal
