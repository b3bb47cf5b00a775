// What is said about a circuit that is read. Functions without state.
#pragma once

#include "index/circuits/circuit.h"

#include <string>
#include <vector>

namespace filiform::tools {

// Throws UsageError if a circuit is one of several inputs.
void refuseSeveralCircuits(const std::vector<std::string>& inputs);
// A line a population, each with a newline.
std::string describePopulations(const std::vector<PopulationReport>& populations);
// The reports of the library, followed by those of the graphs.
std::vector<SourceReport> reportsOf(const Input& input, const Circuit* circuit);

}  // namespace filiform::tools
