#include "tools/words/making/circuit_text.h"

#include "index/errors.h"
#include "index/text.h"
#include "tools/words/numbers.h"

#include <array>
#include <cmath>
#include <cstdio>

namespace filiform::tools {

namespace {

double withThreeDecimals(double value) { return std::round(value * 1000) / 1000 + 0.0; }  // without -0

}  // namespace

void refuseSeveralCircuits(const std::vector<std::string>& inputs) {
  if (inputs.size() < 2) return;
  for (const std::string& input : inputs)
    if (isCircuitConfig(input))
      throw UsageError(inShort(input) +
                       ": a circuit is read alone; leave out the other inputs, or add them with --add");
}

std::string describePopulations(const std::vector<PopulationReport>& populations) {
  std::string text;
  for (const PopulationReport& p : populations) {
    text += "population " + escaped(p.name, 200) + (p.type.empty() ? "" : " (" + escaped(p.type, 60) + ")") + ": " +
            counted(p.nodes, "node") + ", ";
    if (p.vasculature) {
      text += "read as a graph\n";
      continue;
    }
    text += formatCount(p.placed) + " placed, " + formatCount(p.without) + " without a morphology";
    if (p.missing > 0) text += ", " + formatCount(p.missing) + " whose morphology is missing";
    if (p.refused > 0) text += ", " + formatCount(p.refused) + " whose morphology is refused";
    if (p.placed > 0) {
      std::array<char, 160> line{};
      std::snprintf(line.data(), line.size(), "; mean direction of local +y (%.3f, %.3f, %.3f), length %.5f",
                    withThreeDecimals(p.mean_y.x()), withThreeDecimals(p.mean_y.y()), withThreeDecimals(p.mean_y.z()),
                    p.mean_y.norm());
      text += line.data();
    }
    text += '\n';
    for (const std::string& skipped : p.skipped)
      text += "  " + std::string(name(InputCode::W_ATTRIBUTE)) + " " + escaped(skipped, 200) + "; left out\n";
  }
  return text;
}

std::vector<SourceReport> reportsOf(const Input& input, const Circuit* circuit) {
  std::vector<SourceReport> reports = input.reports();
  if (circuit != nullptr) reports.insert(reports.end(), circuit->graphReports().begin(), circuit->graphReports().end());
  return reports;
}

}  // namespace filiform::tools
