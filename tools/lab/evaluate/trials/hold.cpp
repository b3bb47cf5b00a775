#include "tools/lab/evaluate/trials/hold.h"

#include "device/simulated/simulated_hand.h"
#include "solver/workspace/navigation.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <utility>

namespace filiform::tools {

namespace {

constexpr double kPull_s = 0.1;          // duration of the target's motion
constexpr double kWatch_s = 0.5;         // observed time at the end
constexpr double kEnergyWindow_s = 0.1;  // window of the energy

// The largest rise of a running value within a window of this many steps.
class LargestRise {
 public:
  explicit LargestRise(std::size_t window) : window_(window) {}
  void add(double value) {
    while (!least_.empty() && least_.back().second >= value) least_.pop_back();
    least_.emplace_back(count_, value);
    if (least_.front().first + window_ < count_) least_.pop_front();
    largest_ = std::max(largest_, value - least_.front().second);
    ++count_;
  }
  double largest() const { return largest_; }

 private:
  std::size_t window_, count_ = 0;
  std::deque<std::pair<std::size_t, double>> least_;  // ascending: candidates for the least value of the window
  double largest_ = 0;
};

struct Extent {
  Vector3d lo = Vector3d::Constant(std::numeric_limits<double>::infinity()), hi = -lo;
  void add(const Vector3d& p) {
    lo = lo.cwiseMin(p);
    hi = hi.cwiseMax(p);
  }
  double size() const { return (hi - lo).norm(); }
};

}  // namespace

HoldResult runHold(TrialCell& cell, std::uint32_t child, double t, const Vector3d& pull_m, const TrialSetup& setup) {
  const double dt_s = 1 / setup.rate_Hz;
  SimulatedHand hand(trialHandOptions(setup));
  NavigationOptions options = trialNavigationOptions(setup);
  options.force.ramp_s = 0;               // nothing pulls at the start, and a ramp would hide the spring's energy
  options.workspace.drift_speed_m_s = 0;  // a drifting workspace would move a hand that holds
  Navigation navigation(cell.view(), makeTrialSolver(cell, setup), options);
  startTrial(navigation, cell, child, t);
  hand.open();

  const auto ticks = static_cast<std::uint64_t>(std::lround(kHold_s * setup.rate_Hz));
  const auto watched = static_cast<std::uint64_t>(std::lround((kHold_s - kWatch_s) * setup.rate_Hz));
  HoldResult result;
  LargestRise energy(static_cast<std::size_t>(std::lround(kEnergyWindow_s * setup.rate_Hz)));
  Extent hand_extent, pull_extent;
  double given_J = 0, moved_m = 0;
  Wrench wrench;
  Vector3d last_h_D = Vector3d::Zero(), last_p_D = Vector3d::Zero(), first_p_D = Vector3d::Zero();
  for (std::uint64_t i = 0; i < ticks; ++i) {
    const double out = std::min(1.0, static_cast<double>(i) * dt_s / kPull_s);
    hand.setTarget(navigation.workspace().centre_D() + out * pull_m);
    const Vector3d before_N = wrench.force_N;
    const NavigationTick& tick = navigation.tick(hand.exchange(wrench), dt_s);
    wrench = tick.wrench;
    if (i > 0) given_J += before_N.dot(tick.h_D - last_h_D);
    energy.add(given_J + 0.5 * setup.stiffness_N_m * (tick.anchor_D - tick.h_D).squaredNorm());
    if (i >= watched) {
      hand_extent.add(tick.h_D);
      pull_extent.add(tick.anchor_D);
      if (i == watched) first_p_D = tick.anchor_D;
      if (i > watched) moved_m += (tick.anchor_D - last_p_D).norm();
    }
    last_h_D = tick.h_D;
    last_p_D = tick.anchor_D;
  }
  const bool moves = hand_extent.size() > kStill_m || pull_extent.size() > kStill_m;
  // In a single hop the distance from first to last place is the whole movement. An oscillation moves farther.
  result.late_hop = moves && (last_p_D - first_p_D).norm() > 0.9 * moved_m;
  result.oscillates = moves && !result.late_hop;
  result.energy_J = energy.largest();
  return result;
}

}  // namespace filiform::tools
