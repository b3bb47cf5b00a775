#include "tools/lab/bench/knee.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace filiform::tools {

namespace {

constexpr double kLeastBend = 0.1;

struct Point {
  std::size_t index;
  double x, y;
};

}  // namespace

std::optional<std::size_t> kneeOf(const std::vector<double>& x, const std::vector<double>& y, bool x_log, bool y_log) {
  if (x.size() != y.size()) throw std::invalid_argument("kneeOf: x and y differ in length");
  std::vector<Point> points;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (!std::isfinite(x[i]) || !std::isfinite(y[i]) || (x_log && x[i] <= 0) || (y_log && y[i] <= 0)) continue;
    points.push_back({i, x_log ? std::log(x[i]) : x[i], y_log ? std::log(y[i]) : y[i]});
  }
  if (points.size() < 3) return {};
  const auto [low, high] =
      std::minmax_element(points.begin(), points.end(), [](const Point& a, const Point& b) { return a.y < b.y; });
  const double wide = points.back().x - points.front().x, tall = high->y - low->y;
  if (!(wide > 0) || !(tall > 0)) return {};
  std::optional<std::size_t> knee;
  double deepest = kLeastBend;
  for (const Point& p : points) {
    const double t = (p.x - points.front().x) / wide;
    const double line = points.front().y + t * (points.back().y - points.front().y);
    const double below = (line - p.y) / tall;
    if (below <= deepest) continue;
    deepest = below;
    knee = p.index;
  }
  return knee;
}

double logSlope(const std::vector<double>& x, const std::vector<double>& y) {
  if (x.size() != y.size()) throw std::invalid_argument("logSlope: x and y differ in length");
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (!(x[i] > 0) || !(y[i] > 0)) continue;
    const double a = std::log(x[i]), b = std::log(y[i]);
    n += 1, sx += a, sy += b, sxx += a * a, sxy += a * b;
  }
  const double spread = n * sxx - sx * sx;
  return n >= 2 && spread > 0 ? (n * sxy - sx * sy) / spread : std::nan("");
}

}  // namespace filiform::tools
