#include "solver/force/spring_model.h"

#include "device/vector_length.h"

#include <algorithm>
#include <cmath>

namespace filiform {

namespace {

constexpr double kLeastExtension_m = 1e-6;  // a shorter spring does not show how much of its stiffness acts

}  // namespace

LocalModel SpringModel::about(const Eigen::Vector3d& h_D, const Eigen::Vector3d& pull_D, const Eigen::Vector3d& force_N,
                              double stiffness_N_m, const Eigen::Vector3d& along_D) noexcept {
  const double extension_m = lengthOf(pull_D);
  if (extension_m > kLeastExtension_m && std::isfinite(extension_m))
    part_ = std::min(1.0, lengthOf(force_N) / (stiffness_N_m * extension_m));
  LocalModel model;
  model.at_D = h_D;
  model.radius_m = kModelRadius_m;
  model.stiffness_N_m = part_ * stiffness_N_m * (Eigen::Matrix3d::Identity() - along_D * along_D.transpose());
  return model;
}

}  // namespace filiform
