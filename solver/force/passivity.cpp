#include "solver/force/passivity.h"

#include "device/vector_length.h"
#include "index/errors.h"
#include "solver/force/internal/option_check.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace filiform {
namespace {

using Eigen::Vector3d;
using internal::isNotNegative;
using internal::isPositive;
using internal::require;

constexpr double kLeastSpeed_m_s = 1e-4;  // below: noise, and too small to divide by its square

}  // namespace

PassivityController::PassivityController(const PassivityOptions& options) : options_(options) {
  require(isPositive(options.energy_J), "passivity energy (J)", options.energy_J, "> 0");
  require(isNotNegative(options.power_W), "passivity power (W)", options.power_W, ">= 0");
  require(isPositive(options.recovery_1_s), "passivity recovery (1/s)", options.recovery_1_s, "> 0");
  require(isNotNegative(options.max_damping_Ns_m), "passivity damping (N s/m)", options.max_damping_Ns_m, ">= 0");
  if (options.delay_samples < 0 || options.delay_samples > PassivityOptions::kMaxDelay)
    throw UsageError("the delay for passivity is " + std::to_string(options.delay_samples) +
                     " periods; it must be between 0 and " + std::to_string(PassivityOptions::kMaxDelay));
  sent_N_.fill(Vector3d::Zero());
}

Vector3d PassivityController::apply(const Vector3d& force_N, const Vector3d& h_D, double stored_J,
                                    double stored_by_last_proxy_J, double dt_s) noexcept {
  const Vector3d dh_D = h_D - h_D_ + carried_D_;
  const double given_J = given(dh_D);
  h_D_ = h_D;
  carried_D_.setZero();
  double& e = energy_.observed;
  if (!started_ || !std::isfinite(given_J)) {
    started_ = true;
    lo_N_ = kNone;
    hi_N_ = -kNone;
    e = stored_J - (given_J > 0 && std::isfinite(given_J) ? given_J : 0.0);
    weight_ = 1;
    return force_N;
  }
  e = std::min(e - given_J, stored_J);
  energy_.least = std::min(energy_.least, e);
  if (const double injected_J = stored_J - stored_by_last_proxy_J; injected_J > 0) {
    energy_.injected += injected_J;
    energy_.injected_most = std::max(energy_.injected_most, injected_J);
  }
  const bool has_time = dt_s > 0 && std::isfinite(dt_s);
  if (e < 0 && has_time) e = std::min(0.0, e + options_.power_W * dt_s);
  if (!options_.on) return force_N;
  if (has_time) weight_ = std::min(1.0, weight_ + options_.recovery_1_s * dt_s);
  weight_ = std::min(weight_, std::max(0.0, 1 + e / options_.energy_J));
  energy_.weakest = std::min(energy_.weakest, weight_);
  if (!(e < 0) && weight_ == 1) return force_N;

  ++energy_.acted;
  Vector3d allowed_N = force_N;
  if (e < 0 && has_time) {
    const Vector3d v_D = dh_D / dt_s;
    const double speed_m_s = lengthOf(v_D);
    if (speed_m_s > kLeastSpeed_m_s && std::isfinite(speed_m_s))
      allowed_N -= std::min(options_.max_damping_Ns_m, -e / (dt_s * speed_m_s) / speed_m_s) * v_D;
  }
  return weight_ * allowed_N;
}

// The energy (J) that the hand received during the step `dh_D`. Clears the forces that may have acted.
double PassivityController::given(const Vector3d& dh_D) noexcept {
  // The oldest of delay + 1 forces acted while the hand moved.
  const Vector3d oldest_N = sent_N_[static_cast<std::size_t>(at_)];
  mayHaveActed(oldest_N);
  if (doubtful_ > 0) {
    --doubtful_;
    for (int i = 0; i <= options_.delay_samples; ++i) mayHaveActed(sent_N_[static_cast<std::size_t>(i)]);
  }
  if (dh_D.isZero(0)) return 0;
  const double given_J =
      lo_N_ == hi_N_ ? oldest_N.dot(dh_D) : lo_N_.cwiseProduct(dh_D).cwiseMax(hi_N_.cwiseProduct(dh_D)).sum();
  lo_N_ = kNone;
  hi_N_ = -kNone;
  return given_J;
}

void PassivityController::mayHaveActed(const Vector3d& force_N) noexcept {
  lo_N_ = lo_N_.cwiseMin(force_N);
  hi_N_ = hi_N_.cwiseMax(force_N);
}

void PassivityController::acted(const Vector3d& force_N) noexcept {
  Vector3d& last_N = sent_N_[static_cast<std::size_t>(at_ == 0 ? options_.delay_samples : at_ - 1)];
  if (last_N == force_N || !force_N.allFinite()) return;
  if (force_N.isZero(0)) doubtful_ = options_.delay_samples + 1;
  last_N = force_N;
}

void PassivityController::sent(const Vector3d& force_N) noexcept {
  sent_N_[static_cast<std::size_t>(at_)] = force_N;
  at_ = at_ == options_.delay_samples ? 0 : at_ + 1;
}

}  // namespace filiform
