#include "viewer/gl/internal/motion_detector.h"

#include <algorithm>
#include <cmath>

namespace filiform::internal {

namespace {

// Below this the camera trembles.
constexpr double kTremble_px = 0.05;
// The proxy is drawn at a new place once it is this far from the drawn one. Beyond the second distance it moves.
constexpr double kProxyTremble_px = 0.3, kProxyMoves_px = 1;

}  // namespace

bool MotionDetector::cameraMoved(const SceneFrame& frame) const {
  if (!camera_) return true;
  const Camera& now = frame.camera;
  const double px_rad = frame.size.height / (2 * std::tan(now.height_angle_rad / 2));
  const double shift_px = (now.eye_W - camera_->eye_W).norm() / std::max(now.focus_um, 1e-12) * px_rad;
  const double turn_px = (now.rotation_VW - camera_->rotation_VW).norm() * px_rad;
  return shift_px > kTremble_px || turn_px > kTremble_px || now.height_angle_rad != camera_->height_angle_rad;
}

bool MotionDetector::update(const SceneFrame& frame) {
  const Camera& now = frame.camera;
  if (cameraMoved(frame)) {
    camera_ = now;
    moved_s_ = frame.time_s;
  }
  if (frame.proxy_W) {
    const double px_um = frame.size.height / (2 * std::tan(now.height_angle_rad / 2)) / std::max(now.focus_um, 1e-12);
    const auto isBeyond = [&](const std::optional<Vector3d>& from, double most_px) {
      return !from || (*frame.proxy_W - *from).norm() * px_um > most_px;
    };
    if (isBeyond(proxy_W_, kProxyTremble_px)) proxy_W_ = frame.proxy_W;
    if (isBeyond(rest_proxy_W_, kProxyMoves_px)) {
      rest_proxy_W_ = frame.proxy_W;
      moved_s_ = frame.time_s;
    }
  } else {
    proxy_W_.reset();
  }
  return frame.moving ? *frame.moving : frame.time_s - moved_s_ < SceneFrame::kRest_s;
}

}  // namespace filiform::internal
