#include "tools/lab/bench/device/stalls.h"

#include "solver/force/force_law.h"
#include "solver/force/spring_model.h"
#include "tools/bridges/bridge_force.h"
#include "tools/lab/bench/device/energy_meter.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace filiform::tools {

namespace {

using Eigen::Vector3d;

constexpr std::int64_t kBridgeStep_ns = 250'000, kLoopTick_ns = 1'000'000;  // of the bridge, of filiform's loop
constexpr double kStalledPeak_N = 8, kSwungMass_kg = 0.15, kSwungDamping_Ns_m = 5.5,
                 kSwungPull_N_m = 200;  // a medium hand
constexpr double kSwungReach_m = 0.03, kSwung_Hz = 1.3, kSwungRest_s = 1.5;

Vector3d swungTo(double time_s) {
  const double angle = 2 * M_PI * kSwung_Hz * time_s;
  const double part = std::clamp((time_s - kSwungRest_s) / (EnergyMeter::kBegin_s - kSwungRest_s), 0.0, 1.0);
  return part * kSwungReach_m * Vector3d(std::sin(angle), std::sin(0.7 * angle), std::cos(angle));
}

fb_command commandOf(const Wrench& wrench) {
  fb_command c{};
  c.flags = FB_ARM;
  c.ttl_us = FB_TTL_US;
  const Eigen::Matrix3d& k = wrench.model.stiffness_N_m;
  const double six[] = {k(0, 0), k(0, 1), k(0, 2), k(1, 1), k(1, 2), k(2, 2)};
  std::copy_n(six, 6, c.stiffness_N_m);
  std::copy_n(wrench.force_N.data(), 3, c.force_N);
  std::copy_n(wrench.model.at_D.data(), 3, c.at_D);
  c.radius_m = wrench.model.radius_m;
  return c;
}

// Begin and end of each stall (ns), in order.
std::vector<std::pair<std::int64_t, std::int64_t>> drawStalls(const StallRun& run) {
  std::mt19937_64 random(run.seed);
  std::uniform_real_distribution<double> when_s(EnergyMeter::kBegin_s, run.seconds), long_s(0.012, 0.045);
  std::vector<std::pair<std::int64_t, std::int64_t>> stalls;
  for (int i = 0; i < run.stalls; ++i) {
    const double begin_s = when_s(random);
    stalls.emplace_back(std::llround(1e9 * begin_s), std::llround(1e9 * (begin_s + long_s(random))));
  }
  std::sort(stalls.begin(), stalls.end());
  return stalls;
}

}  // namespace

void runStalls(StallRun& run) {
  ForceLawOptions options;
  options.stiffness_N_m = run.stiffness_N_m;
  options.max_force_N = kStalledPeak_N;
  options.passivity.on = true;
  options.passivity.delay_samples = 1;
  ForceLaw law(options);
  SpringModel spring;
  bridge_force bridge;
  bridge_force_begin(&bridge, kStalledPeak_N, 0);
  EnergyMeter meter(run.stiffness_N_m, kStalledPeak_N, options.passivity.power_W);
  const auto stalls = drawStalls(run);
  auto stall = stalls.begin();
  Wrench wrench;
  Vector3d p_D = Vector3d::Zero(), v_D = Vector3d::Zero(), force_N = Vector3d::Zero();
  double last_N = 0, way_m = 0;
  std::uint32_t seq = 0;
  std::int64_t ticked_ns = 0, longest_ns = 0;
  const auto end_ns = static_cast<std::int64_t>(1e9 * run.seconds);
  for (std::int64_t now_ns = kBridgeStep_ns; now_ns < end_ns; now_ns += kBridgeStep_ns) {
    const double now_s = 1e-9 * static_cast<double>(now_ns);
    while (stall != stalls.end() && now_ns >= stall->second) ++stall;
    const bool stalled = stall != stalls.end() && now_ns >= stall->first;
    const bool ticks = now_ns - ticked_ns >= kLoopTick_ns && !stalled;
    if (ticks) {
      const fb_command command = commandOf(wrench);
      bridge_force_command(&bridge, ++seq, &command, 1, now_ns);
    }
    bridge_force_at(&bridge, p_D.data(), v_D.data(), now_ns, force_N.data());
    if (ticks) {
      law.acted(force_N);
      wrench = {};
      wrench.force_N = law.apply(Vector3d::Zero(), p_D, v_D, 1e-9 * static_cast<double>(now_ns - ticked_ns));
      if (!law.fading()) wrench.model = spring.about(p_D, -p_D, wrench.force_N, run.stiffness_N_m, Vector3d::Zero());
      longest_ns = std::max(longest_ns, now_ns - ticked_ns);
      ticked_ns = now_ns;
    }
    const double dt_s = 1e-9 * kBridgeStep_ns;
    v_D += dt_s * (force_N + kSwungPull_N_m * (swungTo(now_s) - p_D) - kSwungDamping_Ns_m * v_D) / kSwungMass_kg;
    const Vector3d dx_D = dt_s * v_D;
    p_D += dx_D;
    meter.step(now_s, force_N, dx_D, p_D);
    if (now_s >= EnergyMeter::kBegin_s) {
      if (bridge_force_part(&bridge, now_ns) < 1) run.ramped_s += dt_s;
      run.largest_rise_N = std::max(run.largest_rise_N, force_N.norm() - last_N - run.stiffness_N_m * way_m);
      run.largest_fall_N = std::max(run.largest_fall_N, last_N - force_N.norm());
    }
    last_N = force_N.norm();
    way_m = dx_D.norm();
  }
  run.strongest_N = meter.strongest_N();
  const double longest_m = meter.longestWay_m(1e-9 * static_cast<double>(longest_ns + kLoopTick_ns));
  const int delay = options.passivity.delay_samples;
  run.beyond_J =
      std::max(0.0, meter.excess_J() - options.passivity.energy_J - (delay + 1) * run.strongest_N * longest_m);
}

}  // namespace filiform::tools
