#include "tools/lab/reference/energy_sweep.h"

#include "index/ingest/memory_tiles.h"
#include "solver/graph/graph_view.h"
#include "solver/loop/loop_gate.h"
#include "solver/workspace/navigation.h"
#include "tools/synthetic/synthetic.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <random>
#include <vector>

namespace filiform::tools {

namespace {

using Eigen::Vector3d;

constexpr double kGuardPeriod_s = 0.002, kStall_s = 0.010;  // as in HapticLoop
constexpr double kFine_s = 0.00025;                         // step of the hand's motion

class Dice {
 public:
  explicit Dice(std::uint64_t seed) : random_(seed) {}
  double between(double lo, double hi) { return lo + (hi - lo) * static_cast<double>(random_() >> 11) * 0x1p-53; }
  double logBetween(double lo, double hi) { return std::exp(between(std::log(lo), std::log(hi))); }
  bool oneIn(double n) { return between(0, n) < 1; }
  std::uint64_t below(std::uint64_t n) { return random_() % n; }
  Vector3d vector(double half) { return {between(-half, half), between(-half, half), between(-half, half)}; }

 private:
  std::mt19937_64 random_;
};

// The events between two moves of the hand that the loop has seen.
struct SeenStep {
  Vector3d lo_N = Vector3d::Constant(std::numeric_limits<double>::infinity()), hi_N = -lo_N, way_m = Vector3d::Zero();
  double given_J = 0, moved_J = 0;

  void add(const Vector3d& force_N, const Vector3d& dh_m) {
    lo_N = lo_N.cwiseMin(force_N);
    hi_N = hi_N.cwiseMax(force_N);
    way_m += dh_m;
    given_J += force_N.dot(dh_m);
    moved_J += std::abs(force_N.dot(dh_m));
  }
  // Energy that the loop cannot see, because it knows only the samples of the motion.
  double unseen_J() const {
    const double most_J = lo_N.cwiseProduct(way_m).cwiseMax(hi_N.cwiseProduct(way_m)).sum();
    return std::max(0.0, given_J - most_J);
  }
};

// A hand and its device. Accounts for the true energy given to the hand.
class TrueHand {
 public:
  TrueHand(Dice& dice, double period_s) : delay_(1 + static_cast<int>(dice.below(2))) {
    kind_ = dice.below(3);
    reach_m_ = dice.logBetween(1e-3, 0.04);
    for (double& f : frequency_Hz_) f = dice.logBetween(0.1, 3);
    reports_ = !dice.oneIn(3);
    // A device that does not report its force has no limits: the loop could not know them.
    if (reports_) {
      clamp_N_ = dice.logBetween(1, 10);
      ramp_s_ = dice.oneIn(2) ? 0.3 : 0;
    }
    period_s_ = period_s;
    pending_.resize(static_cast<std::size_t>(delay_ - 1), Vector3d::Zero());
  }

  int delay() const { return delay_; }
  double time_s() const { return time_s_; }
  double given_J() const { return given_J_; }
  double unseen_J() const { return unseen_J_; }
  double most_step_J() const { return most_step_J_; }

  void advance(double seconds) {
    for (double left_s = seconds; left_s > 0; left_s -= kFine_s) {
      const double dt_s = std::min(left_s, kFine_s);
      time_s_ += dt_s;
      const Vector3d before_m = h_m_;
      move(dt_s);
      const Vector3d dh_m = h_m_ - before_m;
      seen_.add(held_N_, dh_m);
      given_J_ += held_N_.dot(dh_m);
    }
    most_step_J_ = std::max(most_step_J_, seen_.moved_J);
  }

  // An exchange of the guard: its state is not used.
  void relax() { command(Vector3d::Zero()); }

  DeviceState exchange(const Wrench& wrench, bool frozen) {
    const Vector3d sent_N = limited(wrench.force_N);
    command(sent_N);
    if (!frozen) {
      if (last_.p_D != h_m_) {
        unseen_J_ += seen_.unseen_J();
        seen_ = {};
      }
      if (time_s_ - last_.time_s > kStall_s) ramp_from_s_ = time_s_;
      last_.time_s = time_s_;
      last_.p_D = h_m_;
    }
    last_.status = DeviceStatus::ready;
    last_.sent_N.reset();
    if (reports_) last_.sent_N = sent_N;
    return last_;
  }

 private:
  void command(const Vector3d& force_N) {
    if (pending_.empty()) {
      held_N_ = force_N;
      return;
    }
    held_N_ = pending_.front();
    pending_.front() = force_N;
  }

  Vector3d limited(Vector3d force_N) const {
    if (const double length_N = force_N.norm(); length_N > clamp_N_) force_N *= clamp_N_ / length_N;
    if (ramp_s_ > 0) force_N *= std::clamp((time_s_ - ramp_from_s_) / ramp_s_, 0.0, 1.0);
    return force_N;
  }

  void move(double dt_s) {
    const auto wave = [&](std::size_t axis, double phase) {
      return std::sin(2 * M_PI * frequency_Hz_[axis] * time_s_ + phase);
    };
    Vector3d aim_m = Vector3d::Zero();
    if (kind_ == 0) aim_m = reach_m_ * Vector3d(wave(0, 0), wave(1, 1), wave(2, 2));
    if (kind_ == 1) aim_m = reach_m_ * Vector3d(wave(0, 0), 0, 0);  // pump along one axis
    if (kind_ == 2) aim_m = h_m_ + 2e-2 * held_N_ + reach_m_ * Vector3d(wave(0, 0), wave(1, 1), wave(2, 2));  // yield
    Vector3d dh_m = std::min(1.0, dt_s / 0.01) * (aim_m - h_m_);
    if (const double length_m = dh_m.norm(); length_m > 0.5 * dt_s) dh_m *= 0.5 * dt_s / length_m;
    h_m_ = (h_m_ + dh_m).cwiseMax(-0.055).cwiseMin(0.055);
  }

  int delay_;
  std::uint64_t kind_ = 0;
  double reach_m_ = 0, clamp_N_ = std::numeric_limits<double>::infinity(), ramp_s_ = 0, ramp_from_s_ = 0, period_s_ = 0;
  std::array<double, 3> frequency_Hz_{};
  bool reports_ = true;
  std::vector<Vector3d> pending_;  // holds one force if the delay is two samples
  Vector3d held_N_ = Vector3d::Zero(), h_m_ = Vector3d::Zero();
  SeenStep seen_;
  DeviceState last_;
  double time_s_ = 0, given_J_ = 0, unseen_J_ = 0, most_step_J_ = 0;
};

struct EnergyScene {
  EnergyScene() {
    SyntheticOptions options;
    options.cells = 1;
    options.seed = 11;
    SyntheticCells stream(options);
    store = buildTilesInMemory(stream);
    table = std::make_unique<TileTable>(store->tile_count());
    for (TileId id = 0; id < store->tile_count(); ++id) {
      tiles.push_back(store->load(id));
      table->add(*tiles.back());
    }
    graph = std::make_unique<GraphView>(*table, store->leaves(), store->grid());
  }
  ProxyPlace somewhere(Dice& dice) const {
    const Tile& tile = *tiles[dice.below(tiles.size())];
    const auto segment = static_cast<std::uint32_t>(dice.below(tile.segment_count()));
    return graph->placeAt(tile.id(), tile.segmentId(segment), dice.between(0, 1));
  }

  std::unique_ptr<TileStore> store;
  std::vector<std::shared_ptr<const Tile>> tiles;
  std::unique_ptr<TileTable> table;
  std::unique_ptr<GraphView> graph;
};

void energyRun(const EnergyScene& scene, std::uint64_t seed, double seconds, bool feed_back, EnergySweep& sweep) {
  Dice dice(seed);
  const double period_s = dice.oneIn(3) ? 0.002 : 0.001;
  TrueHand hand(dice, period_s);

  NavigationOptions options;
  options.force.stiffness_N_m = dice.logBetween(50, 2000);
  options.force.passivity.on = true;
  options.force.passivity.delay_samples = hand.delay();
  options.drift_force_N_s = 0;  // work of the workspace counts as a command, not here
  options.workspace.zoom_um = dice.logBetween(30, 1000);
  options.buttons.fill(ButtonAction::none);
  SolverParameters parameters;
  parameters.r_min_um = 1;
  parameters.r_max_um = 20;
  const SolverMethod method = kSolverMethods[dice.below(std::size(kSolverMethods))];
  Navigation navigation(*scene.graph, makeProxySolver(method, parameters), options);
  LoopGateOptions gate_options;
  gate_options.period_s = period_s;
  gate_options.ramp_at_start = dice.oneIn(2);
  LoopGate gate(gate_options);
  const ForceLaw& law = navigation.force_law();
  const PassivityOptions& passivity = options.force.passivity;

  int frozen = 0, withheld = 0, fading = 0;
  // The least credit of all windows since the last command: energy given before the window, and the spring's energy.
  double credit_J = std::numeric_limits<double>::infinity();
  double least_given_J = 0, command_J = 0;
  bool commanded = true;
  double law_N = 0;
  const auto jump = [&] {
    NavigationCommand command;
    command.kind = NavigationCommand::Kind::jump;
    command.place = scene.somewhere(dice);
    return command;
  };
  navigation.apply(jump(), Vector3d::Zero());

  while (hand.time_s() < seconds) {
    // During a stalled tick the force is held until the guard acts.
    double wait_s = period_s;
    if (dice.oneIn(400)) {
      wait_s += dice.logBetween(1e-3, 0.2);
      ++sweep.stalls;
    }
    const double stall_s = kStall_s + period_s;
    const double alone_s = std::min(wait_s, stall_s + dice.between(0, kGuardPeriod_s));
    hand.advance(alone_s);
    for (double left_s = wait_s - alone_s; left_s > 0; left_s -= kGuardPeriod_s) {
      hand.relax();
      hand.advance(std::min(left_s, kGuardPeriod_s));
    }
    if (wait_s > stall_s) gate.interrupt();

    if (frozen == 0 && dice.oneIn(600)) {
      frozen = 1 + static_cast<int>(dice.below(60));
      ++sweep.stale;
    }
    DeviceState state = hand.exchange(gate.wrench(), frozen > 0);
    frozen = std::max(0, frozen - 1);
    const double dt_s = gate.take(state, hand.time_s());
    if (!feed_back) state.sent_N.reset();

    if (dice.oneIn(1500)) {
      NavigationCommand command = jump();
      const std::uint64_t kind = dice.below(3);
      if (kind == 1) command.kind = NavigationCommand::Kind::constrain;
      if (kind == 2) command.kind = NavigationCommand::Kind::free;
      navigation.apply(command, state.p_D);
      commanded = true;
      fading = 200;
      ++sweep.commands;
    }
    const double last_N = law_N;
    const NavigationTick& tick = navigation.tick(state, dt_s);
    if (withheld == 0 && dice.oneIn(1000)) {
      withheld = 1 + static_cast<int>(dice.below(800));
      ++sweep.withheld;
    }
    withheld = std::max(0, withheld - 1);
    gate.put(tick.wrench, withheld > 0);
    law_N = tick.wrench.force_N.norm();
    ++sweep.ticks;

    // In any window since a command: at most the spring's energy at its begin, and the bound.
    const double balance_J = hand.given_J() - passivity.power_W * hand.time_s() - hand.unseen_J();
    const double stored_J =
        tick.mode == NavigationMode::constrained ? law.storedEnergy((tick.anchor_D - state.p_D).norm()) : 0.0;
    if (commanded) {
      command_J = law.storedEnergy(last_N / options.force.stiffness_N_m);
      credit_J = std::numeric_limits<double>::infinity();
      least_given_J = hand.given_J();
    }
    commanded = false;
    fading = std::max(0, fading - 1);
    credit_J = std::min(credit_J, balance_J + stored_J + (fading > 0 ? command_J : 0.0));
    least_given_J = std::min(least_given_J, hand.given_J());
    const double allowed_J = passivity.energy_J + (hand.delay() + 1) * hand.most_step_J() + 1e-9;
    const double beyond_J = balance_J - credit_J - allowed_J;
    if (beyond_J > sweep.beyond_J) {
      sweep.beyond_J = beyond_J;
      sweep.worst = seed;
    }
    sweep.most_given_J = std::max(sweep.most_given_J, hand.given_J() - least_given_J);
  }
  sweep.unseen_J = std::max(sweep.unseen_J, hand.unseen_J());
  ++sweep.runs;
}

}  // namespace

EnergySweep energySweep(std::uint64_t first_seed, std::uint64_t runs, double seconds, bool feed_back) {
  const EnergyScene scene;
  EnergySweep sweep;
  for (std::uint64_t i = 0; i < runs; ++i) energyRun(scene, first_seed + i, seconds, feed_back, sweep);
  return sweep;
}

}  // namespace filiform::tools
