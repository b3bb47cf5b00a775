// The panel that colours and selects cells by their attributes: a list of attributes, and the legend. Thread rule: the
// window's thread, between Window::beginPanels() and endPanels().
#pragma once

#include "viewer/window/panels/panel_data.h"

namespace filiform::internal {

// Draws nothing for a scene without attributes. A click on a value of the legend shows it alone; with Ctrl, it is
// added or removed.
void drawAttributes(const PanelData& data, PanelRequests& requests);

}  // namespace filiform::internal
