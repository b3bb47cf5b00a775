// The panels over the picture: help, status, search, force plot, tile map, minimap, settings, cells, tooltip. Thread
// rule: the window's thread, between Window::beginPanels() and endPanels().
#pragma once

#include "viewer/window/panels/panel_data.h"
#include "viewer/window/settings/settings.h"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace filiform {

// Draws all panels, and returns what the user asked for in them.
PanelRequests drawPanels(const PanelData& data, const TilePanel& tiles, OpenPanels& open, SearchPanel& search,
                         Settings& settings);
// Draws the panel that is shown while no scene is open. `since_s`: time since opening began; below 0: nothing is being
// opened.
void drawOpening(const PictureSize& size, double scale, const std::string& what, double since_s,
                 const std::vector<std::string>& messages);

}  // namespace filiform
