#include "tools/lab/evaluate/trials/fan_campaign.h"

#include "tools/synthetic/synthetic_fan.h"

#include <utility>

namespace filiform::tools {

namespace {

CorpusCell fanCell(const FanOptions& options) {
  Fan fan = buildFan(options);
  DrawnRoute route;
  route.first = fan.first;
  route.last = fan.last;
  route.key = options.seed;
  CorpusCell cell;
  cell.cell = std::move(fan.cell);
  cell.routes.push_back(route);
  return cell;
}

}  // namespace

const std::vector<int>& fanBranches() {
  static const std::vector<int> kBranches{3, 5, 7, 10};
  return kBranches;
}

std::vector<FanFamily> runFans(std::uint64_t fans, const std::vector<Condition>& conditions,
                               const CampaignOptions& options) {
  std::vector<FanFamily> families;
  std::uint64_t before = 0, total = 0;
  for (const int branches : fanBranches()) {
    FanFamily family{branches, {}, {}};
    for (std::uint64_t number = 0; number < fans; ++number)
      family.fans.push_back(fanCell(drawFan(options.seed, number, branches)));
    total += countTrials(family.fans, conditions);
    families.push_back(std::move(family));
  }
  for (FanFamily& family : families) {
    CampaignOptions one = options;
    if (options.progress)
      one.progress = [&](std::uint64_t done, std::uint64_t) { options.progress(before + done, total); };
    family.trials = runCampaign(family.fans, conditions, one);
    before += family.trials.rows.size();
  }
  return families;
}

}  // namespace filiform::tools
