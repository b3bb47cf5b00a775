// The menu beside a neurite that was clicked: what is known of it, and what can be done with its cell. Thread rule: the
// window's thread, between Window::beginPanels() and endPanels().
#pragma once

#include "viewer/window/panels/panel_data.h"

namespace filiform::internal {

// Requires an open menu. Closes it when something was chosen.
void drawNeuriteMenu(const PanelData& data, NeuriteMenu& menu, PanelRequests& requests);

}  // namespace filiform::internal
