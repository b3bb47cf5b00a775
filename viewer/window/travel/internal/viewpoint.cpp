#include "viewer/window/travel/internal/viewpoint.h"

#include <algorithm>
#include <cmath>

namespace filiform::internal {

namespace {

// Most shift: farther aside there is nothing to see, and the way back is hard to find.
constexpr double kMostShift = 4;

}  // namespace

void Viewpoint::nextOverview(bool has_far) {
  whole_ = overview_ && has_far && !whole_;
  overview_ = !overview_ || whole_;
  yaw_rad_ = pitch_rad_ = 0;
  factor_ = 1;
  centre();
}

void Viewpoint::set(bool overview, const ViewState::Look& look) {
  overview_ = overview;
  whole_ = overview && look.far;
  yaw_rad_ = look.yaw_rad;
  pitch_rad_ = look.pitch_rad;
  factor_ = std::clamp(look.factor, 1e-4, 4.0);
  pan_ = Eigen::Vector2d(look.shift_x, look.shift_y).cwiseMax(-kMostShift).cwiseMin(kMostShift);
  flight_begin_s_ = -1;
}

void Viewpoint::turn(const Turn& turn) {
  yaw_rad_ -= turn.about_y_rad;
  pitch_rad_ += turn.about_x_rad;
}

void Viewpoint::zoom(double factor) { factor_ = std::clamp(factor_ * factor, 1e-4, 4.0); }

void Viewpoint::pan(double dx_px, double dy_px, const PictureSize& size) {
  const double px_rad = size.height / (2 * std::tan(Camera::kHeightAngle_rad / 2));
  pan_ += Eigen::Vector2d(-dx_px, dy_px) / px_rad;
  pan_ = pan_.cwiseMax(-kMostShift).cwiseMin(kMostShift);
}

void Viewpoint::depart(double now_s, bool at_once) {
  flight_begin_s_ = at_once ? -1 : now_s;
  flight_from_ = shown_;
  overview_ = whole_ = false;
  centre();
}

Camera Viewpoint::look(const NavigationSnapshot& now, const Vector3d& lo_W, const Vector3d& hi_W, double aspect,
                       double now_s) {
  const Shown target{now.centre_W, now.rotation_WD, now.zoom_um};
  const double t = (now_s - flight_begin_s_) / kFlight_s;
  if (flight_begin_s_ >= 0 && t < 1) {
    const double e = t * t * (3 - 2 * t);
    shown_.centre_W = flight_from_.centre_W + e * (target.centre_W - flight_from_.centre_W);
    shown_.rotation_WD = flight_from_.rotation_WD.slerp(e, target.rotation_WD);
    shown_.zoom_um = flight_from_.zoom_um * std::pow(target.zoom_um / flight_from_.zoom_um, e);
  } else {
    shown_ = target;
    flight_begin_s_ = -1;
  }
  workspace_.lay(target.centre_W, target.rotation_WD, target.zoom_um);
  const auto shifted = [&](Camera camera) {
    camera.eye_W += camera.focus_um * camera.rotation_VW.topRows<2>().transpose() * pan_;
    return camera;
  };
  if (overview_) {
    const Camera everything = orbit(overview(lo_W, hi_W, yaw_rad_, pitch_rad_, aspect), 0, 0, factor_);
    return fitDepth(shifted(everything), lo_W, hi_W);
  }
  Workspace seen = workspace_;
  seen.lay(shown_.centre_W, shown_.rotation_WD, shown_.zoom_um);
  return shifted(workspaceCamera(seen, aspect));
}

}  // namespace filiform::internal
