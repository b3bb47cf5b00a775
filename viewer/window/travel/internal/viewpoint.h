// The user's view: of the workspace, which it stays with, or of the whole scene; the user can shift it. After a jump
// the view glides to the new place, so that the user sees the way. Thread rule: one owner.
#pragma once

#include "solver/workspace/navigation_link.h"
#include "solver/workspace/workspace.h"
#include "viewer/scene/camera.h"
#include "viewer/scene/pointer.h"
#include "viewer/scene/view_state.h"

namespace filiform::internal {

class Viewpoint {
 public:
  static constexpr double kFlight_s = 0.5;

  explicit Viewpoint(const WorkspaceOptions& workspace) : workspace_(workspace) {}

  bool isOverview() const { return overview_; }
  ViewState::Look look() const { return {whole_, yaw_rad_, pitch_rad_, factor_, pan_.x(), pan_.y()}; }
  void set(bool overview, const ViewState::Look& look);
  // To the overview, then back to the workspace. `has_far`: in between to the overview of the whole scene.
  void nextOverview(bool has_far = false);
  bool showsFar() const { return whole_; }
  // For the overview only. Navigation turns and zooms the workspace.
  void turn(const Turn& turn);
  void zoom(double factor);
  // Shifts the view so that a point at the focus moves by this many pixels, as the pointer does.
  void pan(double dx_px, double dy_px, const PictureSize& size);
  void centre() { pan_.setZero(); }
  const Eigen::Vector2d& shift() const { return pan_; }  // to the right and upwards, divided by the focus distance

  // Call it when the proxy jumps. Returns to the workspace: the view glides there, unless `at_once`.
  void depart(double now_s, bool at_once);
  bool isGliding() const { return flight_begin_s_ >= 0; }

  // The camera of this frame, for the box of the scene and a picture of this aspect.
  Camera look(const NavigationSnapshot& now, const Vector3d& lo_W, const Vector3d& hi_W, double aspect, double now_s);
  // The hand's workspace as of the last look().
  const Workspace& workspace() const { return workspace_; }

 private:
  struct Shown {
    Vector3d centre_W = Vector3d::Zero();
    Eigen::Quaterniond rotation_WD = Eigen::Quaterniond::Identity();
    double zoom_um = 300;
  };

  Workspace workspace_;
  Shown shown_, flight_from_;
  double flight_begin_s_ = -1;
  bool overview_ = false, whole_ = false;
  double yaw_rad_ = 0, pitch_rad_ = 0, factor_ = 1;
  Eigen::Vector2d pan_ = Eigen::Vector2d::Zero();
};

}  // namespace filiform::internal
