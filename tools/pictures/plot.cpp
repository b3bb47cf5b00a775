#include "tools/pictures/plot.h"

#include "index/errors.h"
#include "tools/pictures/canvas.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <utility>

namespace filiform::tools {

namespace {

// Maps values of one axis to pixels.
struct Axis {
  bool log = false;
  double lo = 0, hi = 1;    // values, or their decimal logarithms
  double from = 0, to = 1;  // pixels

  double inside(double value) const { return log ? std::log10(value) : value; }
  bool shows(double value) const { return std::isfinite(value) && (!log || value > 0); }
  // Far outside as near as Cairo's 24 bits need it: settle() may have cut the range.
  double pixel(double value) const {
    return from + std::clamp((inside(value) - lo) / (hi - lo), -1000.0, 1001.0) * (to - from);
  }
};

void widenAxis(Axis& axis, const std::vector<double>& values, const std::vector<double>& others, const Axis& other,
               bool& any) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!axis.shows(values[i]) || !other.shows(others[i])) continue;
    const double v = axis.inside(values[i]);
    axis.lo = any ? std::min(axis.lo, v) : v;
    axis.hi = any ? std::max(axis.hi, v) : v;
    any = true;
  }
}

// Widens a range of no width, and limits a huge range to what doubles can subtract.
void settle(Axis& axis, bool any) {
  if (!any) {
    axis.lo = 0;
    axis.hi = 1;
  }
  axis.lo = std::max(axis.lo, -1e300);
  axis.hi = std::min(axis.hi, 1e300);
  if (axis.hi - axis.lo <= std::abs(axis.hi) * 1e-12) {
    const double room = axis.log || axis.hi == 0 ? 0.5 : std::abs(axis.hi) * 0.1;
    axis.lo -= room;
    axis.hi += room;
  }
}

struct Tick {
  double value;
  std::string label;  // empty: a finer line without text
};

std::vector<Tick> ticksOf(const Axis& axis, int wanted) {
  std::vector<Tick> out;
  if (!axis.log) {
    const std::vector<double> values = niceTicks(axis.lo, axis.hi, wanted);
    const double step = values.size() > 1 ? values[1] - values[0] : 1;
    for (const double value : values) out.push_back({value, tickLabel(value, step)});
    return out;
  }
  const int first = static_cast<int>(std::floor(axis.lo));
  const int last = static_cast<int>(std::ceil(axis.hi));
  const int every = std::max(1, (last - first) / std::max(wanted, 1));
  for (int decade = first; decade <= last; ++decade) {
    for (int digit = 1; digit < 10; ++digit) {
      const double value = digit * std::pow(10.0, decade);
      const double v = std::log10(value);
      if (v < axis.lo - 1e-9 || v > axis.hi + 1e-9) continue;
      const bool few = last - first <= 2 && (digit == 2 || digit == 5);
      if ((digit == 1 && decade % every == 0) || few) {
        out.push_back({value, tickLabel(value, std::pow(10.0, decade))});
      } else if (every == 1) {
        out.push_back({value, ""});
      }
    }
  }
  const auto labelled = std::count_if(out.begin(), out.end(), [](const Tick& tick) { return !tick.label.empty(); });
  if (labelled >= 2 || axis.hi > 300 || axis.lo < -300) return out;
  // A range within one decade gets the ticks of a linear axis.
  out.clear();
  const std::vector<double> values = niceTicks(std::pow(10.0, axis.lo), std::pow(10.0, axis.hi), wanted);
  const double step = values.size() > 1 ? values[1] - values[0] : 1;
  for (const double value : values)
    if (value > 0) out.push_back({value, tickLabel(value, step)});
  return out;
}

// For each column of pixels: the first, least, greatest and last value, in their order in the series.
class Envelope {
 public:
  void add(const Vector2d& p, std::size_t order) {
    const double column = std::floor(p.x());
    if (points_ > 0 && column != column_) flush();
    if (points_ == 0) {
      column_ = column;
      first_ = least_ = greatest_ = {p, order};
    }
    if (p.y() < least_.p.y()) least_ = {p, order};
    if (p.y() > greatest_.p.y()) greatest_ = {p, order};
    last_ = {p, order};
    ++points_;
  }
  std::vector<Vector2d> take() {
    flush();
    return std::exchange(out_, {});
  }

 private:
  struct Point {
    Vector2d p;
    std::size_t order;
  };

  void flush() {
    if (points_ == 0) return;
    const bool falls = greatest_.order < least_.order;
    for (const Point& point : {first_, falls ? greatest_ : least_, falls ? least_ : greatest_, last_})
      if (out_.empty() || out_.back() != point.p) out_.push_back(point.p);
    points_ = 0;
  }

  std::vector<Vector2d> out_;
  double column_ = 0;
  std::size_t points_ = 0;
  Point first_, least_, greatest_, last_;
};

constexpr double kBroad = 8;  // pixels

Rgba pale(Rgba colour) { return {colour.r, colour.g, colour.b, 90}; }

void drawSeries(Canvas& canvas, const PlotSeries& series, const Axis& x, const Axis& y, Rgba colour) {
  Envelope envelope;
  std::vector<Vector2d> markers;
  const auto draw = [&] {
    const std::vector<Vector2d> points = envelope.take();
    if (points.empty()) return;
    if (points.size() == 1) {
      canvas.disc(points[0], 2.5, colour);
    } else {
      canvas.polyline(points, series.broad ? kBroad : 1.8, series.broad ? pale(colour) : colour);
    }
  };
  for (std::size_t i = 0; i < series.x.size(); ++i) {
    if (!x.shows(series.x[i]) || !y.shows(series.y[i])) {
      draw();
      continue;
    }
    const Vector2d p(x.pixel(series.x[i]), y.pixel(series.y[i]));
    envelope.add(p, i);
    if (series.dots && !series.broad) markers.push_back(p);
  }
  draw();
  for (const Vector2d& p : markers) {
    canvas.disc(p, 4.5, kWhite);
    canvas.disc(p, 3.5, colour);
  }
}

constexpr double kLegendGap = 52;

double legendWidth(Canvas& canvas, const Plot& plot) {
  double width = 0;
  if (plot.series.size() > 1)
    for (const PlotSeries& series : plot.series) width += canvas.textWidth(series.name, 9) + kLegendGap;
  return width;
}

void drawPlotLegend(Canvas& canvas, const Plot& plot, double right, double y) {
  if (plot.series.size() < 2) return;
  for (std::size_t i = plot.series.size(); i-- > 0;) {
    const double width = canvas.textWidth(plot.series[i].name, 9);
    canvas.text(plot.series[i].name, {right - width, y}, 9, kInk);
    const bool broad = plot.series[i].broad;
    canvas.line({right - width - 30, y - 4.5}, {right - width - 8, y - 4.5}, broad ? kBroad : 2.6,
                broad ? pale(seriesColour(i)) : seriesColour(i));
    right -= width + kLegendGap;
  }
}

// The labels of vertical lines, above the axes, in as many rows as needed so that none covers another.
struct LineLabel {
  std::size_t line;
  double at;  // centre, pixels
  int row;
};
constexpr double kLabelRow = 15, kLabelHeight = 8.5;

std::vector<LineLabel> placeLabels(Canvas& canvas, const Plot& plot, const Axis& x) {
  std::vector<LineLabel> labels;
  for (std::size_t i = 0; i < plot.lines.size(); ++i)
    if (x.shows(plot.lines[i].x)) labels.push_back({i, x.pixel(plot.lines[i].x), 0});
  std::sort(labels.begin(), labels.end(), [](const LineLabel& a, const LineLabel& b) { return a.at < b.at; });
  std::vector<double> taken;  // right end of the labels in each row
  for (LineLabel& label : labels) {
    const double half = 0.5 * canvas.textWidth(plot.lines[label.line].label, kLabelHeight);
    label.at = std::max(std::min(label.at, x.to + 16 - half), x.from + half);
    while (label.row < static_cast<int>(taken.size()) &&
           label.at - half < taken[static_cast<std::size_t>(label.row)] + 10)
      ++label.row;
    if (label.row == static_cast<int>(taken.size())) taken.push_back(0);
    taken[static_cast<std::size_t>(label.row)] = label.at + half;
  }
  return labels;
}

void requireSize(const Plot& plot) {
  if (plot.width < 200 || plot.height < 150 || plot.width > 8192 || plot.height > 8192)
    throw UsageError("a plot must be between 200 x 150 and 8192 x 8192 pixels");
}

// The two axes of a plot, and whether any point has a place on them.
struct Axes {
  Axis x, y;
  bool any_x = false, any_y = false;
};

// The range of the axes, without their place in the picture. Throws UsageError if x and y of a series differ in length.
Axes rangesOf(const Plot& plot) {
  Axes axes;
  auto& [x, y, any_x, any_y] = axes;
  x.log = plot.x_log;
  y.log = plot.y_log;
  for (const PlotSeries& series : plot.series) {
    if (series.x.size() != series.y.size())
      throw UsageError("plot: series '" + series.name + "' has " + std::to_string(series.x.size()) + " x but " +
                       std::to_string(series.y.size()) + " y values");
    widenAxis(x, series.x, series.y, y, any_x);
    widenAxis(y, series.y, series.x, x, any_y);
  }
  for (const PlotLine& line : plot.lines)
    if (any_x && x.shows(line.x)) x.lo = std::min(x.lo, x.inside(line.x)), x.hi = std::max(x.hi, x.inside(line.x));
  if (plot.x_most && any_x && x.shows(*plot.x_most)) x.hi = std::max(x.hi, x.inside(*plot.x_most));
  if (plot.y_most && any_y && y.shows(*plot.y_most)) y.hi = std::max(y.hi, y.inside(*plot.y_most));
  settle(x, any_x);
  if (plot.y_from_zero && !y.log && any_y) {
    y.lo = std::min(y.lo, 0.0);
    y.hi = std::max(y.hi, 0.0);
  }
  settle(y, any_y);
  // Leaves space above the curves and, unless the axis ends at zero, below.
  const double air = (y.hi - y.lo) * 0.06;
  if (y.hi != 0 || y.log) y.hi += air;
  if (y.lo != 0 || y.log) y.lo -= air;
  return axes;
}

// The place of each part of a plot, pixels.
struct Layout {
  double left, right, top, bottom;  // of the axes
  bool legend_below;                // below the title, because there is no room beside it
  std::vector<Tick> x_ticks, y_ticks;
  std::vector<LineLabel> labels;
};

// Sets the pixels of both axes.
Layout layoutOf(Canvas& canvas, const Plot& plot, Axes& axes) {
  Layout l;
  const bool headed = !plot.title.empty() || plot.series.size() > 1;
  const double legend_width = legendWidth(canvas, plot);
  l.legend_below =
      legend_width > 0 && !plot.title.empty() && 40 + canvas.textWidth(plot.title, 12) + legend_width > plot.width - 60;
  const double head = 18 + (headed ? 26 : 0) + (plot.subtitle.empty() ? 0 : 20) + (l.legend_below ? 20 : 0);
  l.bottom = plot.height - (plot.x_label.empty() ? 34 : 58);
  l.y_ticks = ticksOf(axes.y, std::max(2, static_cast<int>((l.bottom - head) / 55)));
  double widest = 0;
  for (const Tick& tick : l.y_ticks) widest = std::max(widest, canvas.textWidth(tick.label, 9));
  l.left = std::round(widest + 26 + (plot.y_label.empty() ? 0 : 26));
  l.right = plot.width - 24;
  axes.x.from = l.left;
  axes.x.to = l.right;
  l.labels = placeLabels(canvas, plot, axes.x);
  int rows = 0;
  for (const LineLabel& label : l.labels) rows = std::max(rows, label.row + 1);
  l.top = head + kLabelRow * rows;
  axes.y.from = l.bottom;
  axes.y.to = l.top;
  l.x_ticks = ticksOf(axes.x, std::max(2, static_cast<int>((l.right - l.left) / 110)));
  return l;
}

// Straight lines lie on pixel centres.
double crisp(double pixel) { return std::floor(pixel) + 0.5; }

void drawAxes(Canvas& canvas, const Axes& axes, const Layout& l) {
  for (const Tick& tick : l.y_ticks) {
    const double at = crisp(axes.y.pixel(tick.value));
    canvas.line({l.left, at}, {l.right, at}, 1, tick.label.empty() ? kFinerGridLine : kGridLine);
    canvas.text(tick.label, {l.left - 9, at + 4.5}, 9, kInk, Align::right);
  }
  for (const Tick& tick : l.x_ticks) {
    const double at = crisp(axes.x.pixel(tick.value));
    canvas.line({at, l.top}, {at, l.bottom}, 1, tick.label.empty() ? kFinerGridLine : kGridLine);
    if (tick.label.empty()) continue;
    canvas.line({at, l.bottom}, {at, l.bottom + 5}, 1, kGrey);
    canvas.text(tick.label, {at, l.bottom + 20}, 9, kInk, Align::centre);
  }
  canvas.line({l.left, crisp(l.bottom)}, {l.right, crisp(l.bottom)}, 1, kGrey);
  canvas.line({crisp(l.left), l.top}, {crisp(l.left), l.bottom}, 1, kGrey);
}

void drawCurves(Canvas& canvas, const Plot& plot, const Axes& axes, const Layout& l) {
  const auto& [x, y, any_x, any_y] = axes;
  canvas.clip(l.left - 9, l.top - 9, l.right + 9, l.bottom + 9);
  for (const PlotLine& line : plot.lines) {
    if (!x.shows(line.x)) continue;
    const double at = crisp(x.pixel(line.x));
    canvas.dashes({at, l.top}, {at, l.bottom}, 1.4, kGrey, 5, 4);
    for (const PlotSeries& series : plot.series)
      for (std::size_t i = 0; i < series.x.size() && !series.broad; ++i)
        if (series.x[i] == line.x && y.shows(series.y[i]))
          canvas.disc({x.pixel(line.x), y.pixel(series.y[i])}, 7, kInk);
  }
  for (const bool broad : {true, false})
    for (std::size_t i = 0; i < plot.series.size(); ++i)
      if (plot.series[i].broad == broad) drawSeries(canvas, plot.series[i], x, y, seriesColour(i));
  canvas.clipNothing();
}

void layPlot(Canvas& canvas, const Plot& plot) {
  Axes axes = rangesOf(plot);
  const Layout l = layoutOf(canvas, plot, axes);
  drawAxes(canvas, axes, l);
  drawCurves(canvas, plot, axes, l);
  for (const LineLabel& label : l.labels)
    canvas.text(plot.lines[label.line].label, {label.at, l.top - 5 - kLabelRow * label.row}, kLabelHeight, kInk,
                Align::centre);
  const double middle_x = (l.left + l.right) / 2, middle_y = (l.top + l.bottom) / 2;
  if (!axes.any_x) canvas.text("no data", {middle_x, middle_y}, 12, kGrey, Align::centre);
  canvas.text(plot.title, {l.left, 25}, 12, kInk);
  if (!plot.subtitle.empty()) canvas.text(plot.subtitle, {l.left, 46}, 8.5, kGrey);
  canvas.text(plot.x_label, {middle_x, plot.height - 16.0}, 9.5, kInk, Align::centre);
  canvas.text(plot.y_label, {21, middle_y}, 9.5, kInk, Align::centre, true);
  drawPlotLegend(canvas, plot, l.right, 25 + (l.legend_below ? (plot.subtitle.empty() ? 21 : 41) : 0));
}

}  // namespace

std::vector<double> niceTicks(double lo, double hi, int wanted) {
  const double rough = (hi - lo) / std::max(wanted, 1);
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  double step = 10 * power;
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (rough <= factor * power * 1.0000001) {
      step = factor * power;
      break;
    }
  }
  std::vector<double> out;
  const double first = std::ceil(lo / step - 1e-9);
  const double last = std::floor(hi / step + 1e-9);
  for (double k = first; k <= last && out.size() < 1000; k += 1) out.push_back(k == 0 ? 0 : k * step);
  return out;
}

std::string tickLabel(double value, double step) {
  if (value == 0) return "0";
  char text[64];
  const double magnitude = std::abs(value);
  if (magnitude >= 1e7 || magnitude < 1e-4) {
    int exponent = static_cast<int>(std::floor(std::log10(magnitude) + 1e-12));
    const double mantissa = magnitude / std::pow(10.0, exponent);
    std::snprintf(text, sizeof text, "%.3g", mantissa);
    const std::string digits = std::string(text) == "1" ? "" : std::string(text) + "·";
    return (value < 0 ? "−" : "") + digits + "1e" + (exponent < 0 ? "−" : "") + std::to_string(std::abs(exponent));
  }
  const int decimals = std::clamp(static_cast<int>(std::ceil(-std::log10(std::abs(step)) - 1e-9)), 0, 8);
  std::snprintf(text, sizeof text, "%.*f", decimals, magnitude);
  std::string digits = text;
  const auto point = static_cast<int>(std::min(digits.find('.'), digits.size()));
  if (point > 4)
    for (int at = point - 3; at > 0; at -= 3) digits.insert(static_cast<std::size_t>(at), 1, ' ');
  return (value < 0 ? "−" : "") + digits;
}

Picture drawPlot(const Plot& plot) {
  requireSize(plot);
  Picture picture = whitePicture(plot.width, plot.height);
  {
    Canvas canvas(picture);
    layPlot(canvas, plot);
  }
  return picture;
}

std::string svgPlot(const Plot& plot) {
  requireSize(plot);
  std::string svg;
  {
    Canvas canvas(plot.width, plot.height, svg);
    layPlot(canvas, plot);
  }
  return svg;
}

}  // namespace filiform::tools
