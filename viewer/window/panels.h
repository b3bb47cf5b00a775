// What is written and drawn over the picture: help, status, search, force plot, tile map, minimap, settings, tooltip.
// Thread rule: the window's thread, between Window::beginPanels() and endPanels().
#pragma once

#include "index/streaming/residency.h"
#include "viewer/scene/camera.h"
#include "viewer/window/settings.h"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace filiform {

struct OpenPanels {
  bool help = false, search = false, settings = false;
};

struct SearchPanel {
  std::string text;
  std::vector<std::string> names;  // that fit it
  std::string error;               // of the last go
  bool focus = false;              // the field takes the keyboard at the next frame
};

struct TilePanel {
  struct Box {
    double lo_x, lo_y, hi_x, hi_y;  // um
    TileState state;
  };
  std::vector<Box> boxes;        // nearest to the proxy
  std::uint64_t counts[7] = {};  // by TileState
  std::uint64_t tiles = 0, budget_bytes = 0, frontiers = 0;
  ResidencyCounters counters;
  double read_bytes_s = 0, reads_s = 0;
  bool in_memory = false;
  std::vector<std::string> failures;
};

struct PanelData {
  PictureSize size{};
  double scale = 1;
  double um_px = 0;  // at the proxy; 0: no scale bar
  std::string scene, cell, place, device, mode, stereo, measure, hint;
  std::vector<std::string> messages;  // newest last
  double zoom_um = 0, force_N = 0, mean_frame_ms = 0;
  std::uint64_t segments = 0, left_out = 0, pending = 0;
  double error_px = 0;
  bool frozen = false, overview = false, complete = false;
  const std::vector<float>* forces_N = nullptr;  // oldest first, 1 kHz
  double most_force_N = 8;

  // Over the picture, pixels: the line of the hand's pull; among everything a ring about the proxy.
  std::optional<ScreenPoint> proxy, hand;

  Vector3d lo_W = Vector3d::Zero(), hi_W = Vector3d::Zero();  // of the scene
  Vector3d proxy_W = Vector3d::Zero(), centre_W = Vector3d::Zero();
  std::vector<Vector3d> visited_W, bookmarks_W;
  std::vector<std::string> bookmark_names;

  std::string picture;       // that is being drawn or written; empty: none
  double picture_part = -1;  // of it, 0 to 1; below 0: not known, and it cannot be cancelled any more

  std::string tooltip;
  double tooltip_x = 0, tooltip_y = 0;
};

struct PanelRequests {
  std::optional<std::string> go;    // what was typed or chosen
  std::optional<Vector3d> go_to_W;  // a click on the minimap
  bool cancel_picture = false;
  bool search_changed = false, settings_changed = false, reset = false;
};

PanelRequests drawPanels(const PanelData& data, const TilePanel& tiles, OpenPanels& open, SearchPanel& search,
                         Settings& settings);
// While a scene is opened, or none is.
void drawOpening(const PictureSize& size, double scale, const std::string& what, double since_s,
                 const std::vector<std::string>& messages);

}  // namespace filiform
