// How a person likes the window, kept beside the history of places. Thread-compatible.
#pragma once

#include "viewer/scene/neurite_batches.h"
#include "viewer/scene/stereo.h"

#include <string>

namespace filiform {

struct Settings {
  ColourBy colouring = ColourBy::cell;
  StereoMode stereo = StereoMode::mono;
  bool orthographic = false;    // what is nearer looks no larger
  bool orange_blue = false;     // the fork's colours; else the paper's red and green
  double separation = 1;        // of the eyes, times what is comfortable, 0 .. 2
  double widening = 1;          // of the projection angle's tangent, 0.5 .. 2
  bool reduced_motion = false;  // no flights between places
  double interface_scale = 1;   // of letters, 0.5 .. 4
  bool show_tiles = false, show_force = true, show_minimap = true;
  int width = 1280, height = 800;

  // $XDG_CONFIG_HOME/filiform/view.json, or below ~/.config. Throws UsageError where neither variable is set to an
  // absolute path.
  static std::string path();
  // The defaults where there is no file; values that make no sense are the defaults too. A file that is no JSON is
  // said in `warning`, one line.
  static Settings load(const std::string& path, std::string& warning);
  // Replaces the file at once, its folder made if needed. Throws IoError.
  void save(const std::string& path) const;
};

}  // namespace filiform
