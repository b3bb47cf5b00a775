// The curves of trades: what is exact, the default and the knee, marked. Functions without state.
#pragma once

#include "tools/lab/bench/bench.h"

#include <string>

namespace filiform::tools {

// Values that are not positive are left out on logarithmic axes.
BenchCurve tradeCurve(const std::string& name, const std::string& title, const std::string& x_label,
                      const std::string& y_label, std::vector<PlotSeries> series, bool x_log, bool y_log);
// Adds to the label of a mark that is at `x` already.
void addMark(BenchCurve& curve, double x, const std::string& label);
// Marks the knee (knee.h) of one series, and answers for the finding: "knee at 4", or "no knee".
std::string markKnee(BenchCurve& curve, std::size_t series = 0);

// The law y = c x^exponent through `at_first` at the first x, to stand beside what was measured.
PlotSeries lawSeries(const std::string& name, const std::vector<double>& x, double at_first, double exponent);

// Processor time of the calling thread, s: being put aside for others does not count.
double threadTime_s();

}  // namespace filiform::tools
