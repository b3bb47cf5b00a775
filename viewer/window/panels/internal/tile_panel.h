// The panel of tiles and memory: tile states, read rates, a map of the tiles near the proxy. Thread rule: the window's
// thread, between Window::beginPanels() and endPanels().
#pragma once

#include "viewer/window/panels/panel_data.h"

namespace filiform::internal {

void drawTiles(const PanelData& data, const TilePanel& tiles);

}  // namespace filiform::internal
