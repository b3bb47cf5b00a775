// EnergyMeter: the energy that a force gives to a hand, against the bound of solver/FORCES.md (bound 8), step by step
// and in memory of fixed size. It may lie in memory that two processes share: it holds no pointers. Thread rule: one
// thread steps; others read after it ended.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>

#include <Eigen/Core>

namespace filiform::tools {

class EnergyMeter {
 public:
  static constexpr double kBegin_s = 2;  // the ramps are over

  EnergyMeter(double stiffness_N_m, double most_N, double power_W)
      : stiffness_N_m_(stiffness_N_m), most_N_(most_N), power_W_(power_W) {}

  // The hand moved by dx (m) to p_D while the force (N) acted; the spring pulls to the origin. Times grow.
  void step(double time_s, const Eigen::Vector3d& force_N, const Eigen::Vector3d& dx_D, const Eigen::Vector3d& p_D) {
    if (time_s < kBegin_s) return;
    ++steps_;
    given_J_ += force_N.dot(dx_D);
    strongest_N_ = std::max(strongest_N_, force_N.norm());
    const double balance_J = given_J_ - power_W_ * (time_s - kBegin_s);
    credit_J_ = std::min(credit_J_, balance_J + stored_J(p_D.norm()));
    excess_J_ = std::max(excess_J_, balance_J - credit_J_);
    least_J_ = std::min(least_J_, given_J_);
    given_most_J_ = std::max(given_most_J_, given_J_ - least_J_);
    advance(static_cast<std::int64_t>(1e3 * time_s), dx_D.norm());
  }

  // The most energy beyond the spring's at the begin of a window, and power_W t of that window.
  double excess_J() const { return excess_J_; }
  double given_most_J() const { return given_most_J_; }  // in any window
  double strongest_N() const { return strongest_N_; }
  std::uint64_t steps() const { return steps_; }
  // At least the longest way (m) of the hand in any time_s (s), which counts as the next power of two of ms, at most
  // 128 ms, and one ms more.
  double longestWay_m(double time_s) const {
    std::size_t at = 0;
    while (at + 1 < ways_m_.size() && 1e-3 * static_cast<double>(1 << at) < time_s) ++at;
    return ways_m_[at];
  }

 private:
  double stored_J(double extension_m) const {
    const double within_m = std::min(extension_m, most_N_ / stiffness_N_m_);
    return 0.5 * stiffness_N_m_ * within_m * within_m + most_N_ * (extension_m - within_m);
  }
  void advance(std::int64_t ms, double way_m) {
    if (last_ms_ < 0) last_ms_ = ms;
    // The total way at the begin of each millisecond; a gap repeats it.
    for (int i = 0; last_ms_ < ms && i < 256; ++i) total_m_[static_cast<std::size_t>(++last_ms_ % 256)] = way_m_;
    last_ms_ = ms;
    way_m_ += way_m;
    for (std::size_t i = 0; i < ways_m_.size(); ++i) {
      const std::int64_t from = ms - (std::int64_t{1} << i);
      ways_m_[i] = std::max(ways_m_[i], way_m_ - total_m_[static_cast<std::size_t>(from % 256)]);
    }
  }

  double stiffness_N_m_, most_N_, power_W_;
  double given_J_ = 0, least_J_ = 0, given_most_J_ = 0, strongest_N_ = 0, excess_J_ = 0;
  double credit_J_ = std::numeric_limits<double>::infinity();
  std::uint64_t steps_ = 0;
  double way_m_ = 0;
  std::int64_t last_ms_ = -1;
  std::array<double, 256> total_m_{};
  std::array<double, 8> ways_m_{};
};

}  // namespace filiform::tools
