// A view of a scene as a JSON file: `view --view` and `render --view` show what the window showed. Thread rule: values;
// functions without state.
#pragma once

#include "index/errors.h"
#include "viewer/scene/camera.h"
#include "viewer/scene/colour.h"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Geometry>

namespace filiform {

struct ViewState {
  static constexpr int kVersion = 1;

  std::string set, revision;  // of the scene, for people; empty: none
  // The proxy: its cell and the place; none: the hand was free.
  struct Place {
    std::string cell;
    Vector3d p_W = Vector3d::Zero(), heading_W = Vector3d::Zero();  // heading: as findJunction() has it
  };
  std::optional<Place> place;
  Vector3d centre_W = Vector3d::Zero();  // of the workspace
  Eigen::Quaterniond rotation_WD = Eigen::Quaterniond::Identity();
  double zoom_um = 300;
  bool overview = false;  // of the scene, instead of the workspace
  struct Look {        // how the user turned, zoomed and shifted the overview; the shift also of the workspace's view
    bool far = false;  // with the cells far from all others
    double yaw_rad = 0, pitch_rad = 0, factor = 1, shift_x = 0, shift_y = 0;
  } look;
  std::optional<Camera> camera{};  // of this view; none: that of the workspace
  PictureSize size{};
  bool orthographic = false;
  Theme theme = Theme::dark;
  std::string colour_by = "cell";  // as --colour-by has it
  // Names of cells. `shown`: only these, if `shows_some`; else all but the hidden ones.
  bool shows_some = false;
  std::vector<std::string> shown, hidden, dimmed, chosen, highlighted;
  std::uint8_t hidden_types = 0;  // as CellPalette has them
  struct Bookmark {
    std::string name;
    Vector3d p_W = Vector3d::Zero();
  };
  std::vector<Bookmark> bookmarks;
};

// Two-space JSON, with a line feed at its end.
std::string toJson(const ViewState& view);
// `file`: for messages. A field that is missing or has another form keeps its default, and `notes` names it; so does a
// newer version. Throws InputError for a text that is no view.
ViewState viewStateOf(const std::string& json, const std::string& file, std::vector<std::string>& notes);

}  // namespace filiform
