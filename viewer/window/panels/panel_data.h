// What the panels show, and what the user asked for in them. Thread rule: plain data.
#pragma once

#include "index/streaming/residency.h"
#include "viewer/scene/camera.h"
#include "viewer/scene/cell_colours.h"
#include "viewer/scene/stereo.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace filiform {

namespace internal {
class CellTable;
class ContactView;
}  // namespace internal

struct CellPanel {
  bool open = false;
  bool focus = false;               // give the filter the keyboard in the next frame
  std::vector<std::uint32_t> seen;  // the cells of the rows that were in view
};

struct ContactPanel {
  bool open = false;
  double within_um = 2;
  std::vector<std::uint32_t> seen;  // as above
};

struct OpenPanels {
  bool help = false, search = false, settings = false;
  CellPanel cells;
  ContactPanel contacts;
};

struct SearchPanel {
  std::string text;
  std::vector<std::string> names;  // of cells that match the text
  int chosen = -1;                 // of `names`, by Up and Down; -1: none, Enter takes the text
  std::string error;               // of the last search
  bool focus = false;              // give the field the keyboard in the next frame
};

struct TilePanel {
  struct Box {
    double lo_x, lo_y, hi_x, hi_y;  // um
    TileState state;
  };
  std::vector<Box> boxes;        // of the tiles nearest to the proxy
  std::uint64_t counts[7] = {};  // by TileState
  std::uint64_t tiles = 0, budget_bytes = 0, frontiers = 0;
  ResidencyCounters counters;
  double read_bytes_s = 0, reads_s = 0;
  bool in_memory = false;
  std::vector<std::string> failures;
};

struct PanelData {
  PictureSize size{};  // of the window, points: see Window::points(). So are all lengths of panels
  double scale = 1;    // of letters and panels, points
  double um_px = 0;    // size of a point at the proxy; 0: no scale bar
  std::string scene, cell, place, device, mode, stereo, measure, hint;  // hint: one line or more
  bool show_force = false;                                              // the plot, and what the hand does
  std::vector<std::string> messages;                                    // newest last
  double zoom_um = 0, force_N = 0, mean_frame_ms = 0;
  std::uint64_t segments = 0, left_out = 0, pending = 0;
  double error_px = 0;
  bool frozen = false, overview = false, complete = false;
  std::string network;                           // one line about a slow or lost network; empty: none
  std::uint64_t unreadable = 0;                  // tiles whose last read failed
  const std::vector<float>* forces_N = nullptr;  // oldest first, 1 kHz
  double most_force_N = 8;

  // Points. In the workspace a line connects both: the pull of the hand. In the overview a ring marks the proxy.
  std::optional<ScreenPoint> proxy, hand;

  // Of a companion, likewise; empty: there is none.
  std::string companion_name;
  std::optional<ScreenPoint> companion, companion_hand;
  double companion_force_N = 0;

  Vector3d lo_W = Vector3d::Zero(), hi_W = Vector3d::Zero();  // of the scene
  Vector3d proxy_W = Vector3d::Zero(), centre_W = Vector3d::Zero();
  std::vector<Vector3d> visited_W, bookmarks_W;
  std::vector<std::string> bookmark_names;

  // Of cells. Names: none without attributes. Legend: of the attribute or types that give the colours; nullptr: none.
  std::vector<std::string> attribute_names;
  std::string attribute, selection;  // selection: the condition that selects cells
  const std::vector<CellColours::Entry>* legend = nullptr;
  std::string legend_unit;
  bool selected = false;                 // not all cells are selected
  std::string measuring;                 // text about measures for colours; empty: none
  internal::CellTable* cells = nullptr;  // for the panel of cells; nullptr: there is none
  std::optional<std::uint32_t> chosen_cell;
  const internal::ContactView* contacts = nullptr;  // for the panel of contacts; nullptr: there is none

  std::string picture;       // text about a picture being drawn or written; empty: none
  double picture_part = -1;  // of the picture that is drawn, 0 to 1; below 0: it is being written, too late to cancel

  std::string tooltip;
  double tooltip_x = 0, tooltip_y = 0;
};

struct PanelRequests {
  std::optional<std::string> go;                // the text that was entered, or the name that was chosen
  std::optional<std::string> attribute, value;  // to colour by; a value of the legend that was clicked
  bool value_alone = true, select_all = false;
  std::optional<std::uint32_t> choose_cell, go_to_cell;
  bool find_contacts = false;              // of the proxy's cell
  std::optional<std::size_t> jump_across;  // a contact, by its place in the list
  std::optional<Vector3d> go_to_W;         // the place that was clicked on the minimap
  bool cancel_picture = false;
  bool search_changed = false, settings_changed = false, reset = false;
};

}  // namespace filiform
