#include "tools/lab/evaluate/trials/protocol.h"

#include "device/simulated/simulated_hand.h"
#include "solver/workspace/navigation.h"
#include "tools/lab/evaluate/trials/hold.h"
#include "tools/lab/evaluate/trials/travel_meter.h"
#include "tools/words/numbers.h"

#include <algorithm>
#include <functional>

namespace filiform::tools {

namespace {

std::uint32_t oneIn(std::uint64_t routes, std::uint64_t wanted) {
  return static_cast<std::uint32_t>(std::max<std::uint64_t>(1, routes / std::max<std::uint64_t>(1, wanted)));
}

constexpr int kSceneSeeds = 200, kOtherSceneSeeds = 50, kNamedSceneSeeds = 20;

struct Variant {
  std::string name;
  std::function<void(TrialSetup&)> change;
  bool in_scenes = false;  // also run on the scenes
  int scene_seeds = kOtherSceneSeeds;
};

Variant aimed(double aim_error_m) {
  return {aimVariant(aim_error_m), [aim_error_m](TrialSetup& s) { s.person.aim_error_m = aim_error_m; }, true,
          kSceneSeeds};
}

const std::vector<Variant>& variants() {
  static const std::vector<Variant> kVariants{
      {"as in the main table", [](TrialSetup&) {}},
      {"tremor 0 mm", [](TrialSetup& s) { s.person.tremor_rms_m = 0; }, true},
      {"tremor 1 mm", [](TrialSetup& s) { s.person.tremor_rms_m = 0.001; }, true},
      {"look-ahead 4 mm", [](TrialSetup& s) { s.person.lookahead_m = 0.004; }, true},
      {"a person who tries once", [](TrialSetup& s) { s.person.tries = 1; }, true},
      aimed(0.001),
      aimed(0.002),
      aimed(0.004),
      {"50 N/m", [](TrialSetup& s) { s.stiffness_N_m = 50; }},
      {"500 N/m", [](TrialSetup& s) { s.stiffness_N_m = 500; }},
      {"firm hand 500 N/m", [](TrialSetup& s) { s.hand = "firm", s.stiffness_N_m = 500; }},
      {"loose hand 200 N/m", [](TrialSetup& s) { s.hand = "loose"; }},
      {"delay 1 sample", [](TrialSetup& s) { s.delay_samples = 1; }},
      {"delay 2 samples", [](TrialSetup& s) { s.delay_samples = 2; }},
      {"rate 200 Hz", [](TrialSetup& s) { s.rate_Hz = 200; }},
      {"rate 500 Hz", [](TrialSetup& s) { s.rate_Hz = 500; }},
      {"rate 2 kHz", [](TrialSetup& s) { s.rate_Hz = 2000; }},
      {"rate 4 kHz", [](TrialSetup& s) { s.rate_Hz = 4000; }},
      {"anchor never", [](TrialSetup& s) { s.anchor_use = AnchorUse::never; }},
      {"anchor always", [](TrialSetup& s) { s.anchor_use = AnchorUse::always; }},
      {"work cap 16", [](TrialSetup& s) { s.max_visited = 16; }},
      {"work cap 64", [](TrialSetup& s) { s.max_visited = 64; }},
      {"work cap 128", [](TrialSetup& s) { s.max_visited = 128; }},
      {"float positions and probe",
       [](TrialSetup& s) {
         s.round_probe = true, s.treatment = {true, 0};
       }},
      {"float and 100 mm from the origin",
       [](TrialSetup& s) {
         s.round_probe = true, s.treatment = {true, 1e5};
       }},
      {"float and 1 m from the origin",
       [](TrialSetup& s) {
         s.round_probe = true, s.treatment = {true, 1e6};
       }},
      {"double and 1 m from the origin",
       [](TrialSetup& s) {
         s.treatment = {false, 1e6};
       }},
  };
  return kVariants;
}

}  // namespace

std::string handVariant(const std::string& hand, double stiffness_N_m) {
  return hand + " " + formatNumber(stiffness_N_m) + " N/m";
}

const std::vector<std::pair<std::string, double>>& mainHands() {
  static const std::vector<std::pair<std::string, double>> kHands{{"medium", 200}, {"firm", 200}, {"loose", 50}};
  return kHands;
}

std::vector<double> ablationZooms() { return {300, 1000}; }

const std::vector<double>& aimErrors_m() {
  static const std::vector<double> kErrors{0, 0.001, 0.002, 0.004};
  return kErrors;
}

std::string aimVariant(double aim_error_m) { return "aim error " + formatNumber(1e3 * aim_error_m) + " mm"; }

std::vector<Condition> sceneConditions(const ProtocolOptions& options) {
  std::vector<Condition> conditions;
  const auto add = [&](const std::string& variant, const TrialSetup& setup, int seeds) {
    for (const std::string& method : options.methods) {
      Condition c;
      c.table = "scenes";
      c.variant = variant;
      c.setup = setup;
      c.setup.method = method;
      c.seeds = options.quick ? 1 : seeds;
      c.time_one_in = options.scenes_only ? 0 : 1;
      conditions.push_back(c);
    }
  };
  TrialSetup setup;
  setup.zoom_um = kSceneZoom_um;
  for (const char* hand : {"medium", "firm", "loose"}) {
    setup.hand = hand;
    for (const double stiffness : {200.0, 50.0, 500.0}) {
      setup.stiffness_N_m = stiffness;
      const int seeds = options.scenes_only ? kNamedSceneSeeds : conditions.empty() ? kSceneSeeds : kOtherSceneSeeds;
      add(handVariant(hand, stiffness), setup, seeds);
      if (options.quick || options.scenes_only) return conditions;
    }
  }
  TrialSetup other;
  other.zoom_um = kSceneZoom_um;
  for (const Variant& variant : variants()) {
    if (!variant.in_scenes) continue;
    setup = other;
    variant.change(setup);
    add(handVariant(setup.hand, setup.stiffness_N_m) + "; " + variant.name, setup, variant.scene_seeds);
  }
  return conditions;
}

std::vector<Condition> fanConditions(const ProtocolOptions& options) {
  std::vector<Condition> conditions;
  for (const double aim_error_m : aimErrors_m())
    for (const std::string& method : options.methods) {
      Condition c;
      c.table = "fan";
      c.variant = aimVariant(aim_error_m);
      c.setup.method = method;
      c.setup.zoom_um = kFanZoom_um;
      c.setup.person.aim_error_m = aim_error_m;
      conditions.push_back(c);
    }
  return conditions;
}

std::vector<Condition> routeConditions(const ProtocolOptions& options) {
  std::vector<Condition> conditions;
  for (const auto& [hand, stiffness] : mainHands()) {
    for (const double zoom : options.zooms_um) {
      for (const std::string& method : options.methods) {
        Condition c;
        c.table = "main";
        c.variant = handVariant(hand, stiffness);
        c.setup.method = method;
        c.setup.hand = hand;
        c.setup.stiffness_N_m = stiffness;
        c.setup.zoom_um = zoom;
        c.time_one_in = hand == "medium" ? oneIn(options.routes, 100) : 0;
        conditions.push_back(c);
      }
    }
    if (options.quick) break;
  }
  for (const std::string& method : options.methods) {
    Condition c;
    c.table = "stress";
    c.variant = "medium 200 N/m";
    c.setup.method = method;
    c.setup.zoom_um = kStressZoom_um;
    c.one_in = oneIn(options.routes, 5 * options.ablation_routes);
    conditions.push_back(c);
  }
  for (const Variant& variant : variants()) {
    for (const double zoom : ablationZooms()) {
      for (const std::string& method : options.methods) {
        Condition c;
        c.table = "ablation";
        c.variant = variant.name;
        c.setup.method = method;
        c.setup.zoom_um = zoom;
        variant.change(c.setup);
        if (method == "nearest" && c.setup.max_visited > 0) continue;  // the oracle has no work cap
        c.one_in = oneIn(options.routes, options.ablation_routes);
        conditions.push_back(c);
      }
    }
    if (options.quick && variant.name == "tremor 0 mm") break;
  }
  return conditions;
}

std::vector<std::string> ablationVariants(const std::vector<Condition>& conditions) {
  std::vector<std::string> names;
  for (const Condition& c : conditions)
    if (c.table == "ablation" && std::find(names.begin(), names.end(), c.variant) == names.end())
      names.push_back(c.variant);
  return names;
}

std::vector<std::pair<std::string, std::string>> parameterDump() {
  std::vector<std::pair<std::string, std::string>> dump;
  const auto put = [&](const std::string& name, double value) { dump.emplace_back(name, formatNumber(value)); };
  const TrialSetup setup;
  const PersonParameters& p = setup.person;
  put("person.speed_m_s", p.speed_m_s);
  put("person.lookahead_m", p.lookahead_m);
  put("person.tail_m", p.tail_m);
  put("person.arrive_m", p.arrive_m);
  put("person.progress_m", p.progress_m);
  put("person.stuck_after_s", p.stuck_after_s);
  put("person.push_speed_m_s", p.push_speed_m_s);
  put("person.push_most_m", p.push_most_m);
  put("person.hold_s", p.hold_s);
  put("person.back_off_s", p.back_off_s);
  put("person.tries", p.tries);
  put("person.tremor_rms_m", p.tremor_rms_m);
  put("person.tremor_time_s", p.tremor_time_s);
  put("person.aim_error_m", p.aim_error_m);
  for (const char* name : {"loose", "medium", "firm"}) {
    const HandParameters hand = handParameters(name);
    put(std::string("hand.") + name + ".mass_kg", hand.mass_kg);
    put(std::string("hand.") + name + ".damping_Ns_m", hand.damping_Ns_m);
    put(std::string("hand.") + name + ".stiffness_N_m", hand.stiffness_N_m);
  }
  put("device.damping_Ns_m", SimulatedHandOptions().device_damping_Ns_m);
  put("device.delay_samples", setup.delay_samples);
  put("device.peak_force_N", SimulatedHandOptions().peak_force_N);
  put("loop.rate_Hz", setup.rate_Hz);
  const SolverParameters solver;
  put("solver.max_visited", solver.max_visited);
  put("climb.rest_mm", solver.climb.rest_mm);
  put("climb.gain", solver.climb.gain);
  put("climb.most_mm", solver.climb.most_mm);
  put("climb.patience_1_s", solver.climb.patience_1_s);
  put("climb.pull_mm", solver.climb.pull_mm);
  put("climb.most_pull_mm", solver.climb.most_pull_mm);
  put("climb.growth_1_mm", solver.climb.growth_1_mm);
  put("climb.motion_cost", solver.climb.motion_cost);
  put("anchor.speed_m_s", AnchorOptions().speed_m_s);
  put("anchor.hand_share", AnchorOptions().hand_share);
  put("anchor.most_share_m_s", AnchorOptions().most_share_m_s);
  put("force.gain", automaticParameters(std::vector<double>{1.0}).gain);
  dump.emplace_back("force.r_min_um", "5th percentile of the cell's segment lengths");
  dump.emplace_back("force.r_max_um", "95th percentile of the cell's segment lengths");
  const ForceLawOptions law;
  put("law.damping_Ns_m", law.damping_Ns_m);
  put("law.max_force_N", law.max_force_N);
  put("law.max_slew_N_s", law.max_slew_N_s);
  put("law.ramp_s", law.ramp_s);
  put("law.free_speed_m_s", law.free_speed_m_s);
  put("law.passivity_on", law.passivity.on);
  const WorkspaceOptions workspace;
  put("workspace.static_fraction", workspace.static_fraction);
  put("workspace.drift_speed_m_s", workspace.drift_speed_m_s);
  put("workspace.drift_force_N_s", NavigationOptions().drift_force_N_s);
  put("measure.jerk_N", kJerk_N);
  put("measure.leap_m", TravelMeter::kLeap_m);
  put("measure.leap_chords", TravelMeter::kLeapChords);
  put("hold.duration_s", kHold_s);
  put("hold.still_m", kStill_m);
  const RouteDraw draw;
  put("routes.tip_to_tip_a_cell", draw.tip_to_tip);
  put("routes.shortest_um", draw.shortest_um);
  put("routes.longest_um", draw.longest_um);
  return dump;
}

}  // namespace filiform::tools
