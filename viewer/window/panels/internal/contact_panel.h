// The panel of contacts: lists the contacts of a cell, and jumps across one. Thread rule: the window's thread, between
// Window::beginPanels() and endPanels().
#pragma once

#include "viewer/window/panels/panel_data.h"

namespace filiform::internal {

// Requires data.contacts.
void drawContacts(const PanelData& data, ContactPanel& panel, PanelRequests& requests);

}  // namespace filiform::internal
