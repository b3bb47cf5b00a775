// What an evaluation runs: the conditions, chosen before anything was looked at, the same for every method. README.md
// of this folder says why each is there. Functions without state.
#pragma once

#include "tools/lab/evaluate/campaign.h"

#include <cstdint>
#include <string>
#include <vector>

namespace filiform::tools {

struct ProtocolOptions {
  std::vector<std::string> methods;              // of trialMethods()
  std::vector<double> zooms_um{100, 300, 1000};  // of the main tables, each more than once
  std::uint64_t routes = 0;                      // how many there are
  std::uint64_t ablation_routes = 40;            // about so many of them
  bool quick = false;                            // a few of everything
};

inline constexpr double kStressZoom_um = 3000;
inline constexpr double kSceneZoom_um = 300;
inline constexpr double kFanZoom_um = 300;

// Table "scenes": the medium hand at 200 N/m and each aim error with 200 tremors each; with 50 tremors each the other
// hands and stiffnesses, and other tremors, look-ahead and patience.
std::vector<Condition> sceneConditions(const ProtocolOptions& options);
// Table "fan": the medium hand at 200 N/m with each aim error; one tremor a fan.
std::vector<Condition> fanConditions(const ProtocolOptions& options);
// Table "main": medium and firm hand at 200 N/m, loose at 50; "stress": 3000 um; "ablation": one thing changed at a
// time.
std::vector<Condition> routeConditions(const ProtocolOptions& options);

// "medium, 200 N/m".
std::string handVariant(const std::string& hand, double stiffness_N_m);
// The hands of the main tables with their stiffness.
const std::vector<std::pair<std::string, double>>& mainHands();
// The variants of "ablation", the first being the main condition itself.
std::vector<std::string> ablationVariants(const std::vector<Condition>& conditions);
std::vector<double> ablationZooms();
// The aim errors (m) of the tables, 0 the first, and the variant of each: "aim error 2 mm".
const std::vector<double>& aimErrors_m();
std::string aimVariant(double aim_error_m);

// Every parameter of person, hands, solvers, force law and workspace as they are in this program, by name: what tells
// whether two evaluations are comparable.
std::vector<std::pair<std::string, std::string>> parameterDump();

}  // namespace filiform::tools
