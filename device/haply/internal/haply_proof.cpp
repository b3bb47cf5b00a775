#include "device/haply/internal/haply_proof.h"

#include <algorithm>
#include <cmath>

namespace filiform::internal {

namespace {

constexpr int kBaselineStates = 3, kMostDelay = 7;

}  // namespace

void HaplyProof::reset() noexcept {
  measures_delay_ = true;
  delay_states_ = 0;
  restart();
}

void HaplyProof::restart() noexcept {
  begin(Phase::waiting);
  tried_ = 0;
}

void HaplyProof::begin(Phase next) noexcept {
  phase_ = next;
  states_ = 0;
}

HaplyProof::Found HaplyProof::take(double reported_N) noexcept {
  ++states_;
  const double more_N = reported_N - baseline_N_;
  switch (phase_) {
    case Phase::waiting:
      begin(Phase::before);
      return Found::begun;
    case Phase::before:
      baseline_N_ = reported_N;
      if (states_ > kBaselineStates) begin(Phase::with);
      return Found::nothing;
    case Phase::with:
      if (!(more_N > 0.5 * probe_N_ && more_N < 1.5 * probe_N_)) break;
      if (measures_delay_) delay_states_ = std::min(states_ - 1, kMostDelay);
      measures_delay_ = false;
      begin(Phase::after);
      return Found::nothing;
    case Phase::after:
      if (!(std::abs(more_N) < 0.5 * probe_N_)) break;
      begin(Phase::proven);
      tried_ = 0;
      return Found::proven;
    case Phase::proven:
      return Found::nothing;
  }
  return states_ >= most_states_ ? tryOther() : Found::nothing;
}

HaplyProof::Found HaplyProof::tryOther() noexcept {
  if (++tried_ >= 2) return Found::failed;
  begin(Phase::before);
  return Found::other_name;
}

}  // namespace filiform::internal
