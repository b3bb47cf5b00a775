// The panel of bookmarks: a list, to set, go, delete and undo, and tables in and out. Thread rule: the window's thread,
// between Window::beginPanels() and endPanels().
#pragma once

#include "viewer/window/panels/panel_data.h"

namespace filiform::internal {

void drawBookmarks(const PanelData& data, BookmarkPanel& panel, PanelRequests& requests);

}  // namespace filiform::internal
