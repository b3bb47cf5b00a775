#include "solver/proxy/anchor.h"

#include "device/vector_length.h"
#include "index/errors.h"

#include <algorithm>
#include <cmath>

namespace filiform {

using Eigen::Vector3d;

namespace {

constexpr double kHandTime_s = 0.005;  // low pass of the hand's velocity

}  // namespace

Anchor::Anchor(const AnchorOptions& options) : options_(options) {
  if (!(options.speed_m_s >= 0 && std::isfinite(options.speed_m_s)))
    throw UsageError("the speed of the anchor must be finite and >= 0 m/s");
  if (!(options.hand_share >= 0 && std::isfinite(options.hand_share)))
    throw UsageError("the part of the hand's speed that is added to the anchor's must be finite and >= 0");
  if (!(options.most_share_m_s >= 0 && std::isfinite(options.most_share_m_s)))
    throw UsageError("the upper limit of the speed that is added to the anchor's must be finite and >= 0 m/s");
}

void Anchor::reset() noexcept {
  offset_D_.setZero();
  v_D_.setZero();
  knows_hand_ = false;
}

const Vector3d& Anchor::advance(const Vector3d& moved_D, const Vector3d& h_D, double dt_s) noexcept {
  const double dt = dt_s > 0 && std::isfinite(dt_s) ? dt_s : 0.0;
  if (dt > 0) {
    if (knows_hand_) v_D_ += std::min(1.0, dt / kHandTime_s) * ((h_D - h_D_) / dt - v_D_);
    h_D_ = h_D;
    knows_hand_ = true;
  }
  offset_D_ -= moved_D;
  // The usual tick, without square roots: even the slowest anchor reaches the proxy.
  const double least = options_.speed_m_s * dt;
  if (offset_D_.squaredNorm() < 0.99 * least * least && v_D_.squaredNorm() <= 1e300) {
    offset_D_.setZero();
    return offset_D_;
  }
  const double length = lengthOf(offset_D_);
  const double share_m_s = options_.hand_share * lengthOf(v_D_);
  const double step = (options_.speed_m_s + std::min(share_m_s, options_.most_share_m_s)) * dt;
  if (!std::isfinite(length) || !std::isfinite(share_m_s) || !std::isfinite(step)) {
    reset();
  } else if (length <= step) {
    offset_D_.setZero();
  } else {
    offset_D_ *= 1.0 - step / length;
  }
  return offset_D_;
}

}  // namespace filiform
