// The person's eye: it looks at the workspace, wherever that is moved, or at everything; shifted aside if they like.
// Between two places it glides, so that one sees where one is taken. Thread rule: one owner.
#pragma once

#include "solver/workspace/navigation_link.h"
#include "solver/workspace/workspace.h"
#include "viewer/scene/camera.h"
#include "viewer/scene/pointer.h"

namespace filiform::internal {

class Viewpoint {
 public:
  static constexpr double kFlight_s = 0.5;

  explicit Viewpoint(const WorkspaceOptions& workspace) : workspace_(workspace) {}

  bool isOverview() const { return overview_; }
  void toggleOverview();
  // Of the overview only: the workspace's are the navigation's.
  void turn(const Turn& turn);
  void zoom(double factor);
  // What is under the pointer stays under it while it moves by that many pixels.
  void pan(double dx_px, double dy_px, const PictureSize& size);
  void centre() { pan_.setZero(); }
  const Eigen::Vector2d& shift() const { return pan_; }  // rightwards and upwards, over the distance of the focus

  // The proxy is taken elsewhere: back to the workspace, gliding unless `at_once`.
  void depart(double now_s, bool at_once);
  bool isGliding() const { return flight_begin_s_ >= 0; }

  // For the box of the scene and a picture of such proportions.
  Camera look(const NavigationSnapshot& now, const Vector3d& lo_W, const Vector3d& hi_W, double aspect, double now_s);
  // Where the hand's workspace lies now, as look() found it.
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
  bool overview_ = false;
  double yaw_rad_ = 0, pitch_rad_ = 0, factor_ = 1;
  Eigen::Vector2d pan_ = Eigen::Vector2d::Zero();
};

}  // namespace filiform::internal
