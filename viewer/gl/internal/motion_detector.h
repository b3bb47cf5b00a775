// Tells frames in motion from frames at rest: only frames at rest get the full budget. Thread-compatible.
#pragma once

#include "viewer/gl/scene_frame.h"

#include <optional>

namespace filiform::internal {

class MotionDetector {
 public:
  // Takes the camera and the proxy of the next frame. Returns true until SceneFrame::kRest_s after either last moved;
  // `frame.moving`, if set, is returned instead. Tremble below a fraction of a pixel is rest.
  bool update(const SceneFrame& frame);
  // Where the proxy is drawn. It stays where it was while the proxy trembles. None: no proxy.
  const std::optional<Vector3d>& proxy_W() const { return proxy_W_; }

 private:
  bool cameraMoved(const SceneFrame& frame) const;

  std::optional<Camera> camera_;          // when it last moved
  std::optional<Vector3d> proxy_W_;       // as drawn
  std::optional<Vector3d> rest_proxy_W_;  // when it last moved by more than kProxyMoves_px
  double moved_s_ = -1e300;               // time of the last motion
};

}  // namespace filiform::internal
