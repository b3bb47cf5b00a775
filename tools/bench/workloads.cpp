#include "tools/bench/workloads.h"

namespace filiform::tools {

std::vector<Workload> workloads() {
  std::vector<Workload> all;
  addIndexWorkloads(all);
  addSolverWorkloads(all);
  addParametersWorkloads(all);
  addStabilityWorkloads(all);
  addIngestWorkloads(all);
  addJumpWorkloads(all);
  addStreamingWorkloads(all);
  addLoopWorkloads(all);
  addViewerWorkloads(all);
  return all;
}

}  // namespace filiform::tools
