// The help: all keys and gestures, in two tables beside or below each other. Thread rule: the window's thread, between
// Window::beginPanels() and endPanels().
#pragma once

#include "viewer/window/panels/panel_data.h"

namespace filiform::internal {

// Sets `open` to false when the user closes the help.
void drawHelp(const PanelData& data, bool& open);

}  // namespace filiform::internal
