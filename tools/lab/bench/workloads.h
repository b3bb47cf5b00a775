// The parts of `filiform bench`. Each function appends the workloads of its file; workloads() lists them all.
#pragma once

#include "tools/lab/bench/bench.h"

#include <vector>

namespace filiform::tools {

void addIndexWorkloads(std::vector<Workload>& all);
void addNearestWorkloads(std::vector<Workload>& all);
void addPeersWorkloads(std::vector<Workload>& all);
void addSolverWorkloads(std::vector<Workload>& all);
void addSessionsWorkloads(std::vector<Workload>& all);
void addBridgeWorkloads(std::vector<Workload>& all);
void addServeWorkloads(std::vector<Workload>& all);
void addStabilityWorkloads(std::vector<Workload>& all);
void addIngestWorkloads(std::vector<Workload>& all);
void addJumpWorkloads(std::vector<Workload>& all);
void addCellsWorkloads(std::vector<Workload>& all);
void addContactsWorkloads(std::vector<Workload>& all);
void addStreamingWorkloads(std::vector<Workload>& all);
void addLoopWorkloads(std::vector<Workload>& all);
void addTransportWorkloads(std::vector<Workload>& all);
void addViewerWorkloads(std::vector<Workload>& all);
void addSearchWorkloads(std::vector<Workload>& all);
void addLevelsWorkloads(std::vector<Workload>& all);
void addScaleWorkloads(std::vector<Workload>& all);
void addSceneWorkloads(std::vector<Workload>& all);
void addExtremesWorkloads(std::vector<Workload>& all);

}  // namespace filiform::tools
