// The panel of cells: a table to sort, filter, measure and colour cells, and to go to one. Thread rule: the window's
// thread, between Window::beginPanels() and endPanels().
#pragma once

#include "viewer/window/panels/panel_data.h"

namespace filiform::internal {

// Requires data.cells. Changes the table's order and columns. A click chooses a cell, with Ctrl in addition, with Shift
// the rows between; a double click, or Enter in the filter, goes there.
void drawCells(const PanelData& data, CellPanel& panel, PanelRequests& requests);

}  // namespace filiform::internal
