// Companion: somebody who travels through the same scene elsewhere, as last heard of. Thread rule: a value.
#pragma once

#include "solver/workspace/navigation_link.h"

#include <cmath>
#include <string>

namespace filiform {

struct Companion {
  std::string name;
  Vector3d p_W = Vector3d::Zero(), h_W = Vector3d::Zero();  // proxy and hand, um
  double force_N = 0;
  bool constrained = true;  // the proxy is on a neurite
  // The workspace of the companion.
  Vector3d centre_W = Vector3d::Zero();
  Eigen::Quaterniond rotation_WD = Eigen::Quaterniond::Identity();
  double zoom_um = 300;
  bool along = false;  // the window shows the workspace of the companion instead of its own

  bool isFinite() const {
    return p_W.allFinite() && h_W.allFinite() && centre_W.allFinite() && rotation_WD.coeffs().allFinite() &&
           rotation_WD.norm() > 0.5 && std::isfinite(force_N) && zoom_um > 0 && std::isfinite(zoom_um);
  }
};

}  // namespace filiform
