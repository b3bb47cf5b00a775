#include "tools/lab/evaluate/trials/evaluation_results.h"

#include <algorithm>

namespace filiform::tools {

bool EvaluationResults::has(const std::string& method) const {
  return std::find(protocol.methods.begin(), protocol.methods.end(), method) != protocol.methods.end();
}

std::vector<std::string> EvaluationResults::mainVariants() const {
  std::vector<std::string> variants;
  for (const auto& [hand, stiffness] : mainHands()) {
    variants.push_back(handVariant(hand, stiffness));
    if (options.quick) break;
  }
  return variants;
}

std::uint32_t EvaluationResults::sceneConditionNumber(const std::string& variant, const std::string& method) const {
  return findCondition(scene_conditions, "scenes", variant, method, kSceneZoom_um);
}

const Condition& EvaluationResults::sceneCondition(const std::string& variant, const std::string& method) const {
  return scene_conditions[sceneConditionNumber(variant, method)];
}

TrialSummary EvaluationResults::scene(std::uint32_t number, const std::string& variant,
                                      const std::string& method) const {
  return summarise(scenes, scene_trials, sceneConditionNumber(variant, method), Part::all,
                   [number](const TrialRow& row) { return row.cell == number; });
}

TrialSummary EvaluationResults::routesOf(const std::string& table, const std::string& variant,
                                         const std::string& method, double zoom_um, Part part) const {
  return summarise(corpus.cells, trials, findCondition(conditions, table, variant, method, zoom_um), part);
}

}  // namespace filiform::tools
