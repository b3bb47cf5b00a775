#include "device/haptic_device.h"

#include <algorithm>

namespace filiform {

const char* toString(DeviceStatus status) {
  switch (status) {
    case DeviceStatus::closed:
      return "closed";
    case DeviceStatus::booting:
      return "booting";
    case DeviceStatus::homing:
      return "homing";
    case DeviceStatus::ready:
      return "ready";
    case DeviceStatus::fault:
      return "fault";
  }
  return "unknown";
}

bool isSpring(const LocalModel& model) noexcept {
  constexpr double kMost = 1e9;  // greater numbers could overflow below
  const Eigen::Matrix3d& k = model.stiffness_N_m;
  const double most = k.cwiseAbs().rowwise().sum().maxCoeff(), none = -1e-9 * most * most;
  if (!k.allFinite() || !(most <= kMost) || !(model.at_D.cwiseAbs().maxCoeff() <= kMost)) return false;
  if (!(model.damping_Ns_m >= 0 && model.damping_Ns_m <= kMost) || !(model.radius_m >= 0 && model.radius_m <= kMost) ||
      !(model.time_to_live_s > 0 && model.time_to_live_s <= kMost))
    return false;
  if ((k - k.transpose()).cwiseAbs().maxCoeff() > 1e-9 * most) return false;
  // All principal minors of a symmetric matrix without negative eigenvalue are >= 0.
  return k(0, 0) >= 0 && k(1, 1) >= 0 && k(2, 2) >= 0 && k(0, 0) * k(1, 1) - k(0, 1) * k(0, 1) >= none &&
         k(0, 0) * k(2, 2) - k(0, 2) * k(0, 2) >= none && k(1, 1) * k(2, 2) - k(1, 2) * k(1, 2) >= none &&
         k(0, 0) * (k(1, 1) * k(2, 2) - k(1, 2) * k(1, 2)) - k(0, 1) * (k(0, 1) * k(2, 2) - k(1, 2) * k(0, 2)) +
                 k(0, 2) * (k(0, 1) * k(1, 2) - k(1, 1) * k(0, 2)) >=
             none * most;
}

Wrench finiteOrZero(const Wrench& wrench) noexcept {
  if (!wrench.force_N.allFinite() || !wrench.torque_Nm.allFinite()) return {};
  Wrench whole = wrench;
  if (!isSpring(whole.model)) whole.model = {};
  whole.resistance = whole.resistance > 0 ? std::min(whole.resistance, 1.0) : 0;  // NaN: 0
  return whole;
}

}  // namespace filiform
