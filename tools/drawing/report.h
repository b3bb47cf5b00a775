// Pictures for reports: line plots, and the front view of a piece of tissue with the path travelled through it.
//
//   Plot plot;
//   plot.title = "Force at the hand";
//   plot.x_label = "time (s)";
//   plot.y_label = "force (N)";
//   plot.series.push_back({"force-based", times_s, forces_N});
//   writePng(drawPlot(plot), "force.png");
//
// Thread rule: functions without state; ProjectionPicture is thread-compatible.
#pragma once

#include "index/geometry/grid.h"
#include "tools/drawing/image.h"

#include <cstddef>
#include <cstdint>
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
Image drawPlot(const Plot& plot);
// The same plot as an SVG element, titled as the plot. `description`: for readers who cannot see it (svg_canvas.h).
std::string svgPlot(const Plot& plot, const std::string& description);

// Round values that divide [lo, hi] into about `wanted` parts; their distance is 1, 2 or 5 times a power of ten.
// Requires finite lo < hi.
std::vector<double> niceTicks(double lo, double hi, int wanted);
// The text of a tick: as many decimals as the step needs, thousands separated, a power of ten for long numbers.
std::string tickLabel(double value, double step);

struct ProjectionLevel {  // a horizontal line across the picture
  double y_um = 0;
  std::string label;
  bool strong = false;  // pia, white matter; the others are layer borders
};

struct ProjectionOptions {
  std::string title, subtitle;
  Vector3d lo_um = Vector3d::Zero(), hi_um = Vector3d::Zero();  // box that the picture must contain, frame W
  std::vector<ProjectionLevel> levels;
  int height = 1200;  // pixels; the width is in proportion, between 500 and 2000
};

// The x-y view from the front, y up. Near neurites are stronger and cover far ones. Segments may come in any order and
// number, tile by tile: memory depends on the picture alone.
class ProjectionPicture {
 public:
  // Throws UsageError if the bounds are empty or not finite.
  explicit ProjectionPicture(const ProjectionOptions& options);

  // The cell's number chooses a muted colour. Axons (type 2) are paler than dendrites. `radius_um` may be NaN
  // (unknown).
  void addSegment(std::uint64_t cell, const Vector3d& a_um, const Vector3d& b_um, std::uint16_t type = 0,
                  double radius_um = 0);
  void addSoma(std::uint64_t cell, const Vector3d& centre_um, double radius_um);
  // Adds the travelled path, above everything, from a ring to an arrowhead. Points that are not finite break it.
  void addPath(const std::vector<Vector3d>& path_um);

  // Returns the picture with title, levels and scale bar. May be called once.
  Image finish();

 private:
  Vector2d project(const Vector3d& p_um) const;
  double nearness(double z_um) const;
  void put(const Vector2d& a, const Vector2d& b, double width, Colour colour, double near);

  ProjectionOptions options_;
  double scale_ = 1;  // pixels per um
  Image image_;
  int top_ = 0, bottom_ = 0;     // rows of the view
  std::vector<float> strength_;  // of the segment shown at each pixel: coverage times nearness
  struct Soma {
    Vector2d centre;
    double radius, near;
    Colour colour;
  };
  std::vector<Soma> somata_;
  std::vector<std::vector<Vector2d>> paths_;
};

// Layer borders, pia and white matter of the columns of tools/synthetic/synthetic.h.
std::vector<ProjectionLevel> syntheticLevels();

}  // namespace filiform::tools
