#include "tools/lab/evaluate/trials/trial.h"

#include "device/simulated/simulated_hand.h"
#include "index/errors.h"
#include "solver/workspace/navigation.h"
#include "tools/lab/evaluate/trials/nearest_oracle.h"
#include "tools/lab/evaluate/trials/stuck.h"
#include "tools/lab/evaluate/trials/travel_meter.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <stdexcept>

namespace filiform::tools {

namespace {

double cpuTime_ns() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e9 * static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec);
}

// A solver that sees the probe in single precision.
class RoundedProbe : public ProxySolver {
 public:
  explicit RoundedProbe(std::unique_ptr<ProxySolver> solver) : solver_(std::move(solver)) {}
  const ProxyPlace& place() const noexcept override { return solver_->place(); }
  void setPlace(const ProxyPlace& place) noexcept override { solver_->setPlace(place); }
  void advance(const GraphView& graph, const ProbeState& probe, SolverStep& step) noexcept override {
    solver_->advance(graph, {toSinglePrecision(probe.h_W), probe.dt_s, probe.scale_um_m}, step);
  }
  bool wantsAnchor() const noexcept override { return solver_->wantsAnchor(); }
  void undo() noexcept override { solver_->undo(); }
  void prepare(const GraphView& graph, const Vector3d& ahead_W, std::uint32_t most) noexcept override {
    solver_->prepare(graph, ahead_W, most);
  }

 private:
  std::unique_ptr<ProxySolver> solver_;
};

// Until the visits of `fraction` of all ticks are counted.
std::uint64_t visitPercentile(const VisitCounts& visits, std::uint64_t ticks, double fraction) {
  std::uint64_t seen = 0;
  for (std::size_t count = 0; count < visits.size(); ++count) {
    seen += visits[count];
    if (static_cast<double>(seen) >= fraction * static_cast<double>(ticks)) return count;
  }
  return visits.size() - 1;
}

// The same solver once more over the same probes, timed as a whole.
double timeSolver_ns(TrialCell& cell, const TrialSetup& setup, const ProxyPlace& start, const ProxyPlace& end,
                     const std::vector<ProbeState>& probes) {
  const std::unique_ptr<ProxySolver> solver = makeTrialSolver(cell, setup);
  const auto step = std::make_unique<SolverStep>();
  solver->setPlace(start);
  const double began = cpuTime_ns();
  for (const ProbeState& probe : probes) solver->advance(cell.view(), probe, *step);
  const double took = cpuTime_ns() - began;
  if (solver->place().segment != end.segment || solver->place().t != end.t)
    throw std::logic_error("the solver's second run over the same probes ended elsewhere");
  return took / static_cast<double>(probes.size());
}

}  // namespace

const std::vector<std::string>& trialMethods() {
  static const std::vector<std::string> kMethods{"basic", "shading", "force", "force-listing", "climb", "nearest"};
  return kMethods;
}

std::unique_ptr<ProxySolver> makeTrialSolver(TrialCell& cell, const TrialSetup& setup) {
  std::unique_ptr<ProxySolver> solver;
  if (setup.method == "nearest") {
    solver = makeNearestOracle(cell);
  } else {
    SolverParameters parameters = cell.parameters();
    if (setup.max_visited > 0) parameters.max_visited = setup.max_visited;
    solver = makeProxySolver(solverMethod(setup.method), parameters);
  }
  if (setup.round_probe) solver = std::make_unique<RoundedProbe>(std::move(solver));
  return solver;
}

SimulatedHandOptions trialHandOptions(const TrialSetup& setup) {
  SimulatedHandOptions options;
  options.hand = handParameters(setup.hand);
  options.period_s = 1 / setup.rate_Hz;
  options.delay_samples = setup.delay_samples;
  return options;
}

NavigationOptions trialNavigationOptions(const TrialSetup& setup) {
  NavigationOptions options;
  options.force.stiffness_N_m = setup.stiffness_N_m;
  options.workspace.zoom_um = setup.zoom_um;
  options.leap = setup.leap;
  options.buttons.fill(ButtonAction::none);
  options.anchor_use = setup.anchor_use;
  return options;
}

void startTrial(Navigation& navigation, TrialCell& cell, std::uint32_t child, double t) {
  NavigationCommand jump;
  jump.kind = NavigationCommand::Kind::jump;
  jump.place = cell.placeAt(child, t);
  cell.tree(cell.root(child));
  if (!navigation.apply(jump, navigation.workspace().centre_D()))
    throw UsageError("the trial does not begin on a segment of the cell");
}

TrialResult runTrial(TrialCell& cell, const Route& route, const TrialSetup& setup, VisitCounts* visits,
                     TrialTrace* trace) {
  const double dt_s = 1 / setup.rate_Hz;
  SimulatedHand hand(trialHandOptions(setup));
  Navigation navigation(cell.view(), makeTrialSolver(cell, setup), trialNavigationOptions(setup));
  SimulatedPerson person(route, setup.person, setup.seed);
  startTrial(navigation, cell, route.first_segment().segment, route.first_t());
  hand.open();

  const double scale_um_m = navigation.workspace().scale_um_m();
  TrialResult result;
  result.route_um = route.length_um();
  result.route_m = route.length_um() / scale_um_m;
  const double limit_s = 10 * result.route_m / setup.person.speed_m_s + 20;
  const auto most_ticks = static_cast<std::uint64_t>(std::ceil(limit_s * setup.rate_Hz));

  TravelMeter meter(cell, route, scale_um_m);
  meter.update(navigation.place());
  const auto counts = std::make_unique<VisitCounts>();
  counts->fill(0);
  std::vector<float> steps_N;
  std::vector<ProbeState> probes;
  Vector3d last_force_N = Vector3d::Zero(), last_pull_W = navigation.place().p_W;
  PersonStatus last_status = PersonStatus::travelling;
  double furthest_um = 0;
  Wrench wrench;
  while (true) {
    const NavigationTick& tick = navigation.tick(hand.exchange(wrench), dt_s);
    wrench = tick.wrench;
    const Vector3d& force_N = wrench.force_N;
    const double strength_N = force_N.norm(), step_N = (force_N - last_force_N).norm();
    last_force_N = force_N;
    result.finite = result.finite && std::isfinite(strength_N);
    result.force_integral_Ns += strength_N * dt_s;
    result.max_force_N = std::max(result.max_force_N, strength_N);
    steps_N.push_back(static_cast<float>(step_N));
    result.step_max_N = std::max(result.step_max_N, step_N);
    result.jerks += step_N > kJerk_N;
    // The workspace drifts, but is not turned.
    const Vector3d pull_W = tick.p_W + scale_um_m * (tick.anchor_D - tick.p_D);
    result.jump_max_m = std::max(result.jump_max_m, (pull_W - last_pull_W).norm() / scale_um_m);
    last_pull_W = pull_W;
    result.visited += tick.step.visited;
    result.visited_max = std::max<std::uint64_t>(result.visited_max, tick.step.visited);
    ++(*counts)[std::min<std::size_t>(tick.step.visited, counts->size() - 1)];
    result.capped_ticks += tick.step.capped;
    ++result.ticks;
    meter.update(navigation.place());
    if (trace != nullptr) trace->force_N.push_back(static_cast<float>(strength_N));
    if (setup.measure_time) probes.push_back({tick.h_W, dt_s, scale_um_m});

    hand.setTarget(person.target_D(navigation.place(), navigation.workspace(), dt_s));
    const PersonStatus status = person.status();
    if (person.reached_um() >= furthest_um + setup.person.progress_m * scale_um_m) {
      furthest_um = person.reached_um();
      result.last_stuck = result.last_inherent = 0;
      result.last_climb_m = 0;
    }
    if (status != last_status && (status == PersonStatus::backing_off || status == PersonStatus::gave_up)) {
      const bool inherent = inherentlyStuck(cell, navigation.place(), tick.h_W);
      ++result.stuck, ++result.last_stuck;
      result.stuck_inherent += inherent, result.last_inherent += inherent;
      if (!inherent && status == PersonStatus::gave_up)
        result.last_climb_m = leastClimb_um(cell, navigation.place(), tick.h_W) / scale_um_m;
    }
    last_status = status;
    result.completed = status == PersonStatus::arrived;
    result.out_of_time = !result.completed && status != PersonStatus::gave_up && result.ticks >= most_ticks;
    if (result.completed || status == PersonStatus::gave_up || result.out_of_time) break;
  }

  const double ticks = static_cast<double>(result.ticks);
  result.reached_um = person.reached_um();
  result.mean_force_N = result.force_integral_Ns / (ticks * dt_s);
  const auto p999 = steps_N.begin() + static_cast<std::ptrdiff_t>(std::ceil(0.999 * ticks)) - 1;
  std::nth_element(steps_N.begin(), p999, steps_N.end());
  result.step_p999_N = *p999;
  result.off_um = meter.off_um();
  result.skip_um = meter.skip_um();
  result.visited_p99 = visitPercentile(*counts, result.ticks, 0.99);
  if (result.completed) result.last_stuck = result.last_inherent = 0;
  if (visits != nullptr)
    for (std::size_t i = 0; i < counts->size(); ++i) (*visits)[i] += (*counts)[i];
  if (setup.measure_time)
    result.solver_ns = timeSolver_ns(cell, setup, cell.placeAt(route.first_segment().segment, route.first_t()),
                                     navigation.place(), probes);
  return result;
}

}  // namespace filiform::tools
