// The curves of trade-offs, with the exact point, the default and the knee. Functions without state.
#pragma once

#include "tools/lab/bench/bench.h"

#include <string>

namespace filiform::tools {

// Makes a curve. Values that are not positive are left out on logarithmic axes.
BenchCurve tradeCurve(const std::string& name, const std::string& title, const std::string& x_label,
                      const std::string& y_label, std::vector<PlotSeries> series, bool x_log, bool y_log);
// Adds a labelled line at `x`. If there is a line at `x` already, the label is added to it.
void addLine(BenchCurve& curve, double x, const std::string& label);
// Marks the knee (knee.h) of one series. Returns text for the finding: "knee at 4", or "no knee".
std::string lineAtKnee(BenchCurve& curve, std::size_t series = 0);

// The law y = c x^exponent with the value `at_first` at the first x, for comparison with measurements.
PlotSeries lawSeries(const std::string& name, const std::vector<double>& x, double at_first, double exponent);

// Processor time of the calling thread, s. Time in which other programs run does not count.
double threadTime_s();

}  // namespace filiform::tools
