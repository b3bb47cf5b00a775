#include "tools/lab/bench/workloads.h"

namespace filiform::tools {

std::vector<Workload> workloads() {
  std::vector<Workload> all;
  addIndexWorkloads(all);
  addNearestWorkloads(all);
  addPeersWorkloads(all);
  addSolverWorkloads(all);
  addStabilityWorkloads(all);
  addIngestWorkloads(all);
  addJumpWorkloads(all);
  addCellsWorkloads(all);
  addContactsWorkloads(all);
  addStreamingWorkloads(all);
  addLoopWorkloads(all);
  addTransportWorkloads(all);
  addSearchWorkloads(all);
  addScaleWorkloads(all);
  addSceneWorkloads(all);
  addExtremesWorkloads(all);
  addServeWorkloads(all);
  addSessionsWorkloads(all);
  addBridgeWorkloads(all);
  // Last, because the OpenGL driver starts threads that stay, and other workloads fork.
  addLevelsWorkloads(all);
  addViewerWorkloads(all);
  return all;
}

}  // namespace filiform::tools
