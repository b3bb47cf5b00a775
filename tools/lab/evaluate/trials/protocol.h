// The conditions that an evaluation runs. They were chosen before any result was known, and are the same for every
// method. README.md in this folder gives the reason for each. Functions without state.
#pragma once

#include "tools/lab/evaluate/trials/campaign.h"

#include <cstdint>
#include <string>
#include <vector>

namespace filiform::tools {

struct ProtocolOptions {
  std::vector<std::string> methods;              // from trialMethods()
  std::vector<double> zooms_um{100, 300, 1000};  // of the main tables; each is run with several hands
  std::uint64_t routes = 0;                      // number of routes
  std::uint64_t ablation_routes = 40;            // approximate number of them for ablations
  bool quick = false;                            // a few of everything
  bool scenes_only = false;                      // the medium hand in the scenes, 20 tremors each
};

inline constexpr double kStressZoom_um = 3000;
inline constexpr double kSceneZoom_um = 300;
inline constexpr double kFanZoom_um = 300;

// Table "scenes": the medium hand at 200 N/m with each aim error, 200 tremors each. With 50 tremors each: the other
// hands and stiffnesses, and other tremors, look-ahead and patience.
std::vector<Condition> sceneConditions(const ProtocolOptions& options);
// Table "fan": the medium hand at 200 N/m with each aim error; one tremor a fan.
std::vector<Condition> fanConditions(const ProtocolOptions& options);
// Table "main": medium and firm hand at 200 N/m, loose hand at 50 N/m. Table "stress": 3000 um. Table "ablation": one
// parameter changed at a time.
std::vector<Condition> routeConditions(const ProtocolOptions& options);

// "medium, 200 N/m".
std::string handVariant(const std::string& hand, double stiffness_N_m);
// The hands of the main tables, with their stiffness.
const std::vector<std::pair<std::string, double>>& mainHands();
// The variants of "ablation". The first is the main condition.
std::vector<std::string> ablationVariants(const std::vector<Condition>& conditions);
std::vector<double> ablationZooms();
// The aim errors (m) of the tables, beginning with 0, and the variant of each: "aim error 2 mm".
const std::vector<double>& aimErrors_m();
std::string aimVariant(double aim_error_m);

// The values of every parameter of person, hands, solvers, force law and workspace in this program, by name. Two
// evaluations are comparable if these are equal.
std::vector<std::pair<std::string, std::string>> parameterDump();

}  // namespace filiform::tools
