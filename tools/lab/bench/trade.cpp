#include "tools/lab/bench/trade.h"

#include "tools/lab/bench/knee.h"

#include <cmath>
#include <ctime>

namespace filiform::tools {

BenchCurve tradeCurve(const std::string& name, const std::string& title, const std::string& x_label,
                      const std::string& y_label, std::vector<PlotSeries> series, bool x_log, bool y_log) {
  BenchCurve curve{name, {}, ""};
  Plot& plot = curve.plot;
  plot.title = title;
  plot.x_label = x_label;
  plot.y_label = y_label;
  plot.series = std::move(series);
  plot.x_log = x_log;
  plot.y_log = y_log;
  plot.width = 900;
  plot.height = 420;
  for (PlotSeries& one : plot.series) one.dots = !one.broad;
  return curve;
}

void addLine(BenchCurve& curve, double x, const std::string& label) {
  for (PlotLine& line : curve.plot.lines)
    if (line.x == x) {
      line.label += ", " + label;
      return;
    }
  curve.plot.lines.push_back({x, label});
}

std::string lineAtKnee(BenchCurve& curve, std::size_t series) {
  const PlotSeries& of = curve.plot.series.at(series);
  const auto knee = kneeOf(of.x, of.y, curve.plot.x_log, curve.plot.y_log);
  if (!knee) return "no knee";
  addLine(curve, of.x[*knee], "knee");
  return "knee at " + shown(of.x[*knee]);
}

PlotSeries lawSeries(const std::string& name, const std::vector<double>& x, double at_first, double exponent) {
  PlotSeries law{name, x, {}, false, true};
  for (const double value : x) law.y.push_back(at_first * std::pow(value / x.front(), exponent));
  return law;
}

double threadTime_s() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

}  // namespace filiform::tools
