// What the panels show, and what the user asked for in them. Thread rule: plain data.
#pragma once

#include "index/streaming/residency.h"
#include "solver/proxy/proxy_solver.h"
#include "viewer/scene/camera.h"
#include "viewer/scene/cell_colours.h"
#include "viewer/scene/stereo.h"
#include "viewer/window/settings/bindings.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace filiform {

namespace internal {
class CellChoice;
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

struct BookmarkPanel {
  bool open = false;
  bool focus = false;     // give the field the keyboard in the next frame
  bool can_save = false;  // there is a folder for tables
  std::string name;       // of a new one
};

struct CommandPanel {
  bool open = false;
  bool focus = false;  // give the field the keyboard in the next frame
  std::string text;
  int at = 0;  // of the list: what Enter does
};

// Beside a neurite that was clicked.
struct NeuriteMenu {
  bool open = false;
  double x = 0, y = 0;      // points
  std::string title, text;  // the cell's name; what is known of the place, lines
  std::string copied;       // what "copy" copies
  ProxyPlace place;
};

struct OpenPanels {
  bool help = false, search = false, settings = false;
  NeuriteMenu menu;
  CellPanel cells;
  ContactPanel contacts;
  BookmarkPanel bookmarks;
  CommandPanel commands;
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

struct StatusPanel {
  std::string scene, cell, neurite, place, device, mode, stereo, measure;
  std::string measuring;  // text about measures for colours; empty: none
  std::uint64_t segments = 0, left_out = 0, pending = 0;
  std::uint64_t unreadable = 0;  // tiles whose last read failed
  double error_px = 0;
  bool frozen = false;
};

struct ForcePanel {
  bool shown = false;  // the plot, and what the hand does
  double now_N = 0;
  const std::vector<float>* last_N = nullptr;  // oldest first, 1 kHz
};

// Points. In the workspace a line connects both: the pull of the hand. In the overview a ring marks the proxy.
struct HandMarks {
  bool overview = false;
  std::optional<ScreenPoint> proxy, hand;
};

struct CompanionMarks {  // likewise
  std::string name;
  std::optional<ScreenPoint> proxy, hand;
  double force_N = 0;
};

struct MapPanel {
  Vector3d lo_W = Vector3d::Zero(), hi_W = Vector3d::Zero();  // of the scene
  Vector3d proxy_W = Vector3d::Zero(), centre_W = Vector3d::Zero();
  double zoom_um = 0;
  std::vector<Vector3d> visited_W, bookmarks_W;
  std::vector<std::string> bookmark_names;
};

// Attributes: none without attributes of cells. Legend: of the attribute, types, depths or radii that give the colours.
struct ColourPanel {
  std::vector<std::string> attributes;
  std::string attribute, kind, selection;                   // kind: of a legend without attribute; selection: the
                                                            // condition that selects cells
  const std::vector<CellColours::Entry>* legend = nullptr;  // nullptr: none
  std::string unit;                                         // of the legend
  Rgba unchosen;                                            // of cells that are not selected
  bool selected = false;                                    // not all cells are selected
};

struct CellView {
  internal::CellTable* table = nullptr;          // nullptr: there is no panel of cells
  const internal::CellChoice* choice = nullptr;  // as `table`
};

struct PicturePanel {
  std::string text;  // about a picture being drawn or written; empty: none
  double part = -1;  // of the picture that is drawn, 0 to 1; below 0: it is being written, too late to cancel
};

struct Tooltip {
  std::string text;
  double x = 0, y = 0;
};

struct TextLines {
  std::vector<std::string> messages;  // newest last
  std::string network;                // one line about a slow or lost network; empty: none
  std::string hint;                   // one line or more
};

struct PanelData {
  PictureSize size{};  // of the window, points: see Window::points(). So are all lengths of panels
  double scale = 1;    // of letters and panels, points
  double um_px = 0;    // size of a point at the proxy; 0: no scale bar
  StatusPanel status;
  ForcePanel force;
  HandMarks hand;
  CompanionMarks companion;
  MapPanel map;
  ColourPanel colours;
  CellView cells;
  const internal::ContactView* contacts = nullptr;  // nullptr: there is no panel of contacts
  PicturePanel picture;
  Tooltip tooltip;
  TextLines lines;
};

struct BookmarkRequests {
  std::optional<std::string> set, go, remove;  // names
  std::optional<std::string> paste;            // a table
  bool undo = false, copy = false, save = false;
};

struct PanelRequests {
  BookmarkRequests bookmarks;
  std::optional<std::string> go;                // the text that was entered, or the name that was chosen
  std::optional<std::string> attribute, value;  // to colour by; a value of the legend that was clicked
  bool value_alone = true, select_all = false;
  std::optional<std::vector<std::uint32_t>> choose_cells;  // alone
  std::optional<std::uint32_t> toggle_cell, go_to_cell;
  Action act = Action::none;            // that was chosen from a panel
  std::optional<std::uint32_t> act_on;  // a cell; none: the chosen ones
  std::optional<ProxyPlace> go_to_place;
  std::optional<std::string> copy;
  bool find_contacts = false;              // of the proxy's cell
  std::optional<std::size_t> jump_across;  // a contact, by its place in the list
  std::optional<Vector3d> go_to_W;         // the place that was clicked on the minimap
  bool cancel_picture = false;
  bool search_changed = false, settings_changed = false, reset = false;
};

}  // namespace filiform
