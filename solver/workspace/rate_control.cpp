#include "solver/workspace/rate_control.h"

#include "device/vector_length.h"
#include "index/errors.h"

#include <algorithm>
#include <cmath>

namespace filiform {

using Eigen::Vector3d;

namespace {

// e^x for |x| <= 1, by its series. Unlike std::exp, it gives the same bits on every machine.
double exponential(double x) {
  constexpr int kTerms = 18;  // 1 / 18! < 2^-52
  double sum = 1;
  for (int n = kTerms; n > 0; --n) sum = 1 + x / n * sum;
  return sum;
}

}  // namespace

RateControl::RateControl(const RateControlOptions& options) : options_(options) {
  if (!(options.leash_m > 0 && std::isfinite(options.leash_m)))
    throw UsageError("the greatest distance from proxy to probe must be finite and > 0 m");
  if (!std::isfinite(options.zoom_per_rad)) throw UsageError("the zoom for a turn of 1 rad must be finite");
}

Vector3d RateControl::probe(const Vector3d& p_D, const Vector3d& v_D, double dt_s) noexcept {
  const Vector3d step = v_D * dt_s;
  if (!(dt_s > 0) || !step.allFinite() || v_D.isZero(0)) {
    offset_D_.setZero();
  } else {
    offset_D_ += step;
    const double length = lengthOf(offset_D_);
    if (length > options_.leash_m) offset_D_ *= options_.leash_m / length;
    if (!offset_D_.allFinite()) offset_D_.setZero();
  }
  probe_D_ = p_D + offset_D_;
  return probe_D_;
}

void RateControl::moveProxy(const Vector3d& p_D) noexcept {
  offset_D_ = probe_D_ - p_D;
  if (!offset_D_.allFinite()) offset_D_.setZero();
}

double RateControl::strain() const noexcept { return lengthOf(offset_D_) / options_.leash_m; }

double RateControl::zoomFactor(double about_z_rad_s, double dt_s) const noexcept {
  const double exponent = options_.zoom_per_rad * about_z_rad_s * dt_s;
  return std::isfinite(exponent) ? exponential(std::clamp(exponent, -1.0, 1.0)) : 1.0;
}

}  // namespace filiform
