#include "tools/lab/evaluate/evaluation.h"

#include "index/errors.h"
#include "index/text.h"
#include "tools/lab/evaluate/report/evaluation_output.h"
#include "tools/lab/evaluate/report/report_sections.h"
#include "tools/lab/evaluate/trials/evaluation_results.h"
#include "tools/lab/evaluate/trials/scenes.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

namespace filiform::tools {

namespace {

constexpr std::uint64_t kFans = 200, kQuickFans = 4;  // of each number of branches

std::string methodList() {
  std::string list;
  for (const std::string& method : trialMethods()) list += (list.empty() ? "" : ", ") + method;
  return list;
}

ProtocolOptions protocolOf(const EvaluationOptions& options) {
  for (const std::string& method : options.methods)
    if (std::find(trialMethods().begin(), trialMethods().end(), method) == trialMethods().end())
      throw UsageError("--methods: no method is called " + method + "; choose " + methodList());
  for (const double zoom : options.zooms_um)
    if (!(zoom > 0 && std::isfinite(zoom))) throw UsageError("--zooms: give zooms > 0 in um across 12 cm");
  ProtocolOptions protocol;
  protocol.methods = options.methods.empty() ? trialMethods() : options.methods;
  if (!options.zooms_um.empty()) protocol.zooms_um = options.zooms_um;
  protocol.quick = options.quick;
  return protocol;
}

std::vector<Condition> leaping(std::vector<Condition> conditions, double leap) {
  for (Condition& one : conditions) one.setup.leap = leap;
  return conditions;
}

TrialCorpus corpusOf(CellStream& cells, const EvaluationOptions& options) {
  RouteDraw draw;
  draw.seed = options.seed;
  const std::uint64_t routes = options.routes > 0       ? options.routes
                               : options.quick          ? 4
                               : options.corpus.empty() ? 24
                                                        : 2000;
  TrialCorpus corpus = drawCorpus(cells, routes, draw);
  if (corpus.listed == 0)
    throw UsageError("--corpus " + escaped(options.corpus) +
                     ": no usable neuron in it; filiform check lists what is wrong");
  if (corpus.cells.empty())
    throw InputError("no cell has a route of 40 um or more; is the unit of the files another one than um?");
  return corpus;
}

CampaignOptions campaignOptions(const EvaluationOptions& options, const std::string& stage) {
  CampaignOptions campaign;
  campaign.seed = options.seed;
  campaign.threads = options.threads;
  campaign.progress = [&options, stage](std::uint64_t done, std::uint64_t total) {
    if (options.progress) options.progress(stage, done, total);
  };
  return campaign;
}

EvaluationResults measure(CellStream& cells, const EvaluationOptions& options) {
  EvaluationResults r;
  r.options = options;
  r.protocol = protocolOf(options);
  r.corpus = corpusOf(cells, options);
  r.protocol.routes = r.corpus.routes;
  r.scenes = evaluationScenes();
  r.scene_conditions = leaping(sceneConditions(r.protocol), options.leap);
  r.fan_conditions = leaping(fanConditions(r.protocol), options.leap);
  r.conditions = leaping(routeConditions(r.protocol), options.leap);
  r.scene_trials = runCampaign(r.scenes, r.scene_conditions, campaignOptions(options, "scenes"));
  r.fans = runFans(options.quick ? kQuickFans : kFans, r.fan_conditions, campaignOptions(options, "fans"));
  r.trials = runCampaign(r.corpus.cells, r.conditions, campaignOptions(options, "routes"));
  HoldOptions hold;
  hold.methods = r.protocol.methods;
  hold.seed = options.seed;
  hold.threads = options.threads;
  hold.quick = options.quick;
  hold.progress = [&](std::uint64_t groups) {
    if (options.progress) options.progress("hold test", 0, groups);
  };
  r.holds = runHolds(r.corpus.cells, hold);
  return r;
}

std::string evaluateScenes(const EvaluationOptions& options) {
  EvaluationResults r;
  r.options = options;
  r.protocol = protocolOf(options);
  r.protocol.scenes_only = true;
  r.scenes = evaluationScenes(options.scenes);
  r.scene_conditions = leaping(sceneConditions(r.protocol), options.leap);
  r.scene_trials = runCampaign(r.scenes, r.scene_conditions, campaignOptions(options, "scenes"));
  writeEvaluationData(r);
  return markdownTable(sceneForceTable(r));
}

std::vector<PageSection> sectionsOf(const EvaluationResults& r, Goals& goals) {
  std::vector<PageSection> sections;
  sections.push_back(sceneSection(r, goals));
  sections.push_back(fanSection(r, goals));
  sections.push_back(routeSection(r));
  if (r.has("climb")) sections.push_back(pairedSection(r));
  sections.push_back(failureSection(r));
  sections.push_back(ablationSection(r));
  sections.push_back(holdSection(r));
  addClimbGoals(r, goals);
  sections.insert(sections.begin(), aboutSection(r, goals));
  sections.push_back(parameterSection());
  return sections;
}

}  // namespace

std::string evaluate(CellStream& cells, const EvaluationOptions& options) {
  if (!options.scenes.empty()) return evaluateScenes(options);
  const auto began = std::chrono::steady_clock::now();
  const EvaluationResults r = measure(cells, options);
  Goals goals;
  const std::vector<PageSection> sections = sectionsOf(r, goals);
  writeEvaluationData(r);
  const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  writeEvaluationReport(r, sections, wall_s);
  return markdownTable(goals.table()) + '\n' + markdownTable(fanSummaryTable(r)) + '\n' +
         markdownTable(routeTable(r, "main", "main", r.mainVariants().front(), r.protocol.zooms_um, Part::all)) + '\n' +
         options.out + "/evaluate.html has everything, after " + shown(wall_s) + " s\n";
}

}  // namespace filiform::tools
