// The measurements of an evaluation, before they become tables. Thread-compatible.
#pragma once

#include "tools/lab/evaluate/trials/campaign.h"
#include "tools/lab/evaluate/trials/evaluation_options.h"
#include "tools/lab/evaluate/trials/fan_campaign.h"
#include "tools/lab/evaluate/trials/hold_campaign.h"
#include "tools/lab/evaluate/trials/protocol.h"
#include "tools/lab/evaluate/trials/summary.h"
#include "tools/lab/evaluate/trials/trial_corpus.h"

#include <cstdint>
#include <string>
#include <vector>

namespace filiform::tools {

struct EvaluationResults {
  EvaluationOptions options;
  ProtocolOptions protocol;
  TrialCorpus corpus;
  std::vector<CorpusCell> scenes;
  std::vector<Condition> scene_conditions, fan_conditions, conditions;
  Campaign scene_trials, trials;
  std::vector<FanFamily> fans;
  std::vector<HoldSeries> holds;

  bool has(const std::string& method) const;
  // The hands of the main tables, in the form of handVariant().
  std::vector<std::string> mainVariants() const;

  const Condition& sceneCondition(const std::string& variant, const std::string& method) const;
  // The position of the condition in scene_conditions. Throws std::logic_error for an unknown condition.
  std::uint32_t sceneConditionNumber(const std::string& variant, const std::string& method) const;
  // Summary of the trials of scene `number` (from 0). Throws std::logic_error for an unknown condition.
  TrialSummary scene(std::uint32_t number, const std::string& variant, const std::string& method) const;
  // Summary of the trials on routes. Throws std::logic_error for an unknown condition.
  TrialSummary routesOf(const std::string& table, const std::string& variant, const std::string& method, double zoom_um,
                        Part part = Part::all) const;
};

}  // namespace filiform::tools
