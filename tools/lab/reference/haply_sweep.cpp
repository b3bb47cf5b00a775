#include "tools/lab/reference/haply_sweep.h"

#include "device/haply/haply_device.h"
#include "device/haply/simulated_haply.h"
#include "solver/force/force_law.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace filiform::tools {

namespace {

using Eigen::Vector3d;

constexpr double kReach_m = 0.03, kSwing_Hz = 1.3;  // of the person's hand
constexpr int kFault = 701, kFaultTicks = 5;        // a fault begins every so many ticks, and lasts so many

HaplySweep::Cell sweepCell(double stiffness_N_m, int command_delay, double period_s, double seconds, bool controls,
                           HaplySweep& all) {
  SimulatedHaplyOptions simulated;
  simulated.period_s = period_s;
  simulated.command_delay = command_delay;
  simulated.hand = {.mass_kg = 0.15, .damping_Ns_m = 0.5, .stiffness_N_m = 60};  // vibrates where it can
  simulated.device_damping_Ns_m = 0;
  SimulatedHaply service(simulated);
  HaplyOptions options;
  options.connect = service.connections();
  HaplyDevice haply(options);
  haply.open();
  if (haply.status() != DeviceStatus::ready) throw std::runtime_error(haply.advice());

  ForceLawOptions law_options;
  law_options.stiffness_N_m = stiffness_N_m;
  law_options.passivity.on = controls;
  law_options.passivity.delay_samples = haply.capabilities().delay_samples;
  ForceLaw law(law_options);
  const PassivityOptions& passivity = law_options.passivity;

  HaplySweep::Cell cell{stiffness_N_m, 1 + command_delay, period_s, 0, 0};
  const double begin_J = service.given_J();
  double credit_J = std::numeric_limits<double>::infinity(), least_J = 0, last_s = haply.exchange({}).time_s;
  Wrench wrench;
  SimulatedHaplyFaults& faults = service.faults();
  const auto ticks = static_cast<int>(seconds / period_s);
  const double start_s = last_s;
  for (int tick = 0; tick < ticks; ++tick) {
    const double angle = 2 * M_PI * kSwing_Hz * tick * period_s;
    service.hand().setTarget(
        {kReach_m * std::sin(angle), kReach_m * std::sin(0.7 * angle), kReach_m * std::cos(angle)});
    const bool is_faulty = tick % kFault < kFaultTicks && tick > kFault;
    faults.is_silent = is_faulty && tick / kFault % 2 == 0;
    faults.holds = is_faulty && tick / kFault % 2 == 1;
    const DeviceState state = haply.exchange(wrench);
    if (state.status != DeviceStatus::ready) throw std::runtime_error(std::string("not ready: ") + haply.advice());
    if (state.sent_N) law.acted(*state.sent_N);
    const double dt_s = state.time_s - last_s;
    last_s = state.time_s;
    wrench.force_N = law.apply(Vector3d::Zero(), state.p_D, state.v_D, dt_s);

    // In any window: at most the spring's energy at its begin, and the bound.
    const double given_J = service.given_J() - begin_J;
    const double balance_J = given_J - passivity.power_W * (last_s - start_s);
    credit_J = std::min(credit_J, balance_J + law.storedEnergy(state.p_D.norm()));
    least_J = std::min(least_J, given_J);
    const double allowed_J = passivity.energy_J + (passivity.delay_samples + 1) * service.most_step_J();
    cell.beyond_J = std::max(cell.beyond_J, balance_J - credit_J - allowed_J);
    cell.given_J = std::max(cell.given_J, given_J - least_J);
    ++all.ticks;
  }
  all.unanswered += haply.counters().unanswered;
  return cell;
}

}  // namespace

HaplySweep haplySweep(double seconds, bool controls) {
  HaplySweep sweep;
  for (const double stiffness_N_m : {50.0, 200.0, 800.0, 3200.0})
    for (const int command_delay : {0, 1, 3})
      for (const double period_s : {0.0005, 0.001, 0.002}) {
        sweep.cells.push_back(sweepCell(stiffness_N_m, command_delay, period_s, seconds, controls, sweep));
        sweep.beyond_J = std::max(sweep.beyond_J, sweep.cells.back().beyond_J);
      }
  return sweep;
}

}  // namespace filiform::tools
