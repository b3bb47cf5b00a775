// The user's settings of the window, kept in a file. Thread-compatible.
#pragma once

#include "viewer/scene/colour.h"
#include "viewer/scene/neurite_batches.h"
#include "viewer/scene/stereo.h"

#include <optional>
#include <string>

namespace filiform {

struct Settings {
  Theme theme = Theme::dark;  // of panels, and of the ground of the picture
  ColourBy colouring = ColourBy::cell;
  StereoMode stereo = StereoMode::mono;
  bool orthographic = false;    // orthographic instead of perspective view
  bool own_cell = true;         // inside, draw the proxy's cell through the others, which are dimmed
  bool orange_blue = false;     // colours of the fork; false: the paper's red and green
  double separation = 1;        // of the eyes; 1: comfortable; 0 .. 2
  double widening = 1;          // factor on the tangent of the projection angle, 0.5 .. 2
  bool reduced_motion = false;  // jump without gliding
  double interface_scale = 1;   // of letters, 0.5 .. 4
  bool show_tiles = false, show_minimap = true;
  std::optional<bool> show_force{};  // none: with a device, and not with the mouse
  int width = 1280, height = 800;

  // $XDG_CONFIG_HOME/filiform/view.json, else $HOME/.config/filiform/view.json. Throws UsageError if neither variable
  // is an absolute path.
  static std::string path();
  // Returns the defaults if there is no file. A value outside its range gets its default. For a file that is no JSON
  // object, sets `warning` to one line and returns the defaults.
  static Settings load(const std::string& path, std::string& warning);
  // Replaces the file atomically, and makes its folder if needed. Throws IoError.
  void save(const std::string& path) const;

  friend bool operator==(const Settings&, const Settings&) = default;
};

}  // namespace filiform
