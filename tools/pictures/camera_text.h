// Cameras and picture sizes as people write them, for `filiform render` and the service. Functions without state.
#pragma once

#include "viewer/scene/camera.h"

#include <string>
#include <vector>

namespace filiform::tools {

struct CameraText {
  enum class Kind {
    around,  // from outside, at these angles: front, back, left, right, top, bottom, or YAW,PITCH in degrees
    follow,  // the view of the workspace
    places,  // X,Y,Z:X,Y,Z, um: the eye and what it looks at
  };
  Kind kind = Kind::around;
  double yaw_rad = 0, pitch_rad = 0;
  Vector3d eye_W = Vector3d::Zero(), target_W = Vector3d::Zero();
};

// An empty text is the front. Throws UsageError, which names `what`, if the text is none of the above.
CameraText parseCamera(const std::string& what, const std::string& text);

// WIDTHxHEIGHT, each from 1 to `most`. Throws UsageError, which names `what`.
PictureSize parseSize(const std::string& what, const std::string& text, int most);

// `count` numbers with commas between. Throws UsageError, which names `what`.
std::vector<double> parseNumberList(const std::string& what, const std::string& text, std::size_t count);
Vector3d parsePoint(const std::string& what, const std::string& text);

}  // namespace filiform::tools
