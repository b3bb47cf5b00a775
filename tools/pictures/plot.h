// Line plots.
//
//   Plot plot;
//   plot.title = "Force at the hand";
//   plot.x_label = "time (s)";
//   plot.y_label = "force (N)";
//   plot.series.push_back({"force-based", times_s, forces_N});
//   writePng(drawPlot(plot), "force.png");
//
// Functions without state.
#pragma once

#include "viewer/gl/renderer.h"

#include <optional>
#include <string>
#include <vector>

namespace filiform::tools {

struct PlotSeries {
  std::string name;  // for the legend, which is drawn for more than one series
  std::vector<double> x,
      y;  // of equal length; a point that is not finite (or not positive on a logarithmic axis) breaks the line
  bool dots = false;   // draw a dot on each point: for few points
  bool broad = false;  // pale and broad, behind the others: for a reference
};

struct PlotLine {  // a labelled vertical line: a knee, a frontier
  double x = 0;
  std::string label;
};

struct Plot {
  std::string title, subtitle;
  std::string x_label, y_label;  // with units, as in "force (N)"
  std::vector<PlotSeries> series;
  std::vector<PlotLine> lines;
  bool x_log = false, y_log = false;
  bool y_from_zero = true;  // a linear y axis includes 0
  int width = 1200, height = 500;
  std::optional<double> x_most, y_most;  // the axes reach at least this value: for plots that are compared
};

// Draws the plot. A series with more points than the plot has columns is drawn by the least and the greatest value in
// each column, so that peaks stay visible. Throws UsageError if x and y of a series differ in length, or the picture
// would be under 200 x 150 or over 8192 x 8192 pixels. O(points + pixels).
Picture drawPlot(const Plot& plot);
// The same plot as an SVG document.
std::string svgPlot(const Plot& plot);

// Round values that divide [lo, hi] into about `wanted` parts; their distance is 1, 2 or 5 times a power of ten.
// Requires finite lo < hi.
std::vector<double> niceTicks(double lo, double hi, int wanted);
// The text of a tick: as many decimals as the step needs, thousands separated, a power of ten for long numbers.
std::string tickLabel(double value, double step);

}  // namespace filiform::tools
