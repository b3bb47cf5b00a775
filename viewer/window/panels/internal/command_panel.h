// The command palette: a field and the list of what the window can do. Thread rule: the window's thread, between
// Window::beginPanels() and endPanels().
#pragma once

#include "viewer/window/panels/panel_data.h"

#include <vector>

namespace filiform::internal {

// The bindings that one press of a key does, and whose words begin with all words of the text; letter case does not
// count. They are in the order of the table.
std::vector<const Binding*> commandsFor(const std::string& text);

// Up and Down move in the list; Enter or a click does the command, and closes the panel.
void drawCommands(const PanelData& data, CommandPanel& panel, PanelRequests& requests);

}  // namespace filiform::internal
