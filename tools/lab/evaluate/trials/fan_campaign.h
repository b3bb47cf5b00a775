// Runs every method on fans (tools/synthetic/synthetic_fan.h): branches that leave a node nearly parallel. Function
// without state.
#pragma once

#include "tools/lab/evaluate/trials/campaign.h"

#include <cstdint>
#include <vector>

namespace filiform::tools {

struct FanFamily {  // fans with this number of branches
  int branches;
  std::vector<CorpusCell> fans;  // one route each
  Campaign trials;
};

// The numbers of branches that are run, ascending.
const std::vector<int>& fanBranches();
// Draws `fans` fans of each number of branches with options.seed (drawFan) and travels each under every condition. The
// number of a fan is its position in `fans`. options.progress counts over all families.
std::vector<FanFamily> runFans(std::uint64_t fans, const std::vector<Condition>& conditions,
                               const CampaignOptions& options);

}  // namespace filiform::tools
