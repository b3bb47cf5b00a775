// hide() of neurites.h.
#include "index/tile/internal/neurites.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <unordered_map>

#include <Eigen/Geometry>

namespace filiform {
namespace {

constexpr std::size_t kViews = 7;

// A picture of the block from one direction: which pixels are covered.
class Mask {
 public:
  Mask(const Vector3d& right, const Vector3d& up) : right_(right), up_(up) {}

  // Makes room for the points between `lo` and `hi`, in pixels.
  void cover(const Vector3d& lo, const Vector3d& hi) {
    const Vector3d middle = (lo + hi) / 2, half = (hi - lo) / 2;
    const double x = half.dot(right_.cwiseAbs()), y = half.dot(up_.cwiseAbs());
    left_ = middle.dot(right_) - x - 1;
    bottom_ = middle.dot(up_) - y - 1;
    width_ = static_cast<std::size_t>(2 * x + 4);
    const auto height = static_cast<std::size_t>(2 * y + 4);
    bits_.assign((width_ * height + 63) / 64, 0);
  }
  // The place of a point, in 2^-16 of a pixel.
  struct Place {
    std::int32_t x, y;
  };
  const Vector3d& right() const { return right_; }
  const Vector3d& up() const { return up_; }
  double left() const { return left_; }
  double bottom() const { return bottom_; }
  // Calls use(pixel) for the pixels of a segment until it returns false.
  template <typename Use>
  bool trace(const Place& a, const Place& b, const Use& use) const {
    const std::int32_t way_x = b.x - a.x, way_y = b.y - a.y;
    const std::int32_t steps = (std::max(std::abs(way_x), std::abs(way_y)) >> 16) + 1;
    const std::int32_t step_x = way_x / steps, step_y = way_y / steps;
    std::int32_t x = a.x, y = a.y;
    for (std::int32_t i = 0; i < steps; ++i, x += step_x, y += step_y)
      if (!use(static_cast<std::size_t>(y >> 16) * width_ + static_cast<std::size_t>(x >> 16))) return false;
    return use(static_cast<std::size_t>(b.y >> 16) * width_ + static_cast<std::size_t>(b.x >> 16));
  }
  bool isSet(std::size_t pixel) const { return (bits_[pixel / 64] >> (pixel % 64) & 1) != 0; }
  void set(std::size_t pixel) { bits_[pixel / 64] |= std::uint64_t{1} << (pixel % 64); }

 private:
  Vector3d right_, up_;
  double left_ = 0, bottom_ = 0;
  std::size_t width_ = 0;
  std::vector<std::uint64_t> bits_;
};

std::vector<Mask> masksOf(const Vector3d& lo, const Vector3d& hi) {
  static constexpr std::array<std::array<int, 3>, kViews> kDirections{
      {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}, {1, 1, -1}, {1, -1, 1}, {-1, 1, 1}}};
  std::vector<Mask> masks;
  masks.reserve(kViews);
  for (const auto& way : kDirections) {
    const Vector3d d(way[0], way[1], way[2]);
    const Vector3d side = way[2] == 0 ? Vector3d::UnitZ() : Vector3d(way[1], -way[0], 0);
    const Vector3d right = side.squaredNorm() > 0 ? Vector3d(side / side.norm()) : Vector3d(Vector3d::UnitX());
    const Vector3d up = d.cross(right);
    masks.emplace_back(right, up / up.norm());
    masks.back().cover(lo, hi);
  }
  return masks;
}

// The places of a point in all pictures. The loops have the length of whole vectors, which compilers then use.
using Places = std::array<Mask::Place, kViews + 1>;  // the last is unused

class Projection {
 public:
  void add(std::size_t view, const Mask& mask) {
    set(2 * view, mask.right(), mask.left());
    set(2 * view + 1, mask.up(), mask.bottom());
  }
  Places operator()(const Vector3d& p) const {
    constexpr double kOne = 65536;
    std::array<std::int32_t, kLanes> at;
    for (std::size_t i = 0; i < kLanes; ++i)
      at[i] = static_cast<std::int32_t>((p[0] * x_[i] + (p[1] * y_[i] + p[2] * z_[i]) - begin_[i]) * kOne);
    Places places;
    for (std::size_t view = 0; view <= kViews; ++view) places[view] = {at[2 * view], at[2 * view + 1]};
    return places;
  }

 private:
  static constexpr std::size_t kLanes = 2 * (kViews + 1);
  void set(std::size_t lane, const Vector3d& axis, double begin) {
    x_[lane] = axis[0];
    y_[lane] = axis[1];
    z_[lane] = axis[2];
    begin_[lane] = begin;
  }
  std::array<double, kLanes> x_{}, y_{}, z_{}, begin_{};
};

class Hider {
 public:
  Hider(Neurites& all, const Grid& grid, double pixel_um)
      : all_(all), scale_(grid.quantum_um() / pixel_um), kept_(all.points.size(), 0) {
    GridBox box;
    for (const NeuritePoint& point : all.points) box.extend(point.p);
    origin_ = box.lo;
    masks_ = masksOf(Vector3d::Zero(), at(box.hi));
    for (std::size_t view = 0; view < kViews; ++view) project_.add(view, masks_[view]);
  }

  void choose(bool every_cell) {
    if (every_cell) keepOfEachCell();
    for (const std::uint32_t i : longestFirst()) {
      const NeuritePath& path = all_.paths[i];
      Places last = placesOf(path.begin);
      if (path.isBall()) kept_[path.begin] = every_cell || keepIfSeen(last, last) ? 1 : 0;
      for (std::uint32_t k = 1; k < path.count; ++k) {
        const Places next = placesOf(path.begin + k);
        if (kept_[path.begin + k] == 0) kept_[path.begin + k] = keepIfSeen(last, next) ? 1 : 0;
        last = next;
      }
    }
  }

  void apply(double pixel_um) {
    for (const NeuritePath& path : all_.paths)
      for (std::uint32_t k = path.isBall() ? 0 : 1; k < path.count; ++k)
        if (kept_[path.begin + k] == 0) count(path.begin + k, path.isBall(), pixel_um);
    cutOut(all_, kept_);
  }

 private:
  Vector3d at(const GridPoint& p) const { return (p - origin_).cast<double>() * scale_; }
  double lengthOf(std::uint32_t point) const {
    return (all_.points[point].p - all_.points[point - 1].p).cast<double>().norm() * scale_;
  }

  // The paths by the binary exponent of their length; of equal exponents as they come, which is near in memory.
  std::vector<std::uint32_t> longestFirst() const {
    constexpr int kLongest = 24, kShortest = -8;  // exponents, in pixels
    std::vector<std::uint8_t> classes(all_.paths.size());
    std::array<std::size_t, kLongest - kShortest + 2> begin{};
    for (std::size_t i = 0; i < classes.size(); ++i) {
      const NeuritePath& path = all_.paths[i];
      double length = 0;
      for (std::uint32_t k = 1; k < path.count; ++k) length += lengthOf(path.begin + k);
      int exponent = kShortest;
      if (length > 0) std::frexp(length, &exponent);
      classes[i] = static_cast<std::uint8_t>(kLongest - std::clamp(exponent, kShortest, kLongest));
      ++begin[classes[i] + 1u];
    }
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    std::vector<std::uint32_t> order(classes.size());
    for (std::uint32_t i = 0; i < order.size(); ++i) order[begin[classes[i]]++] = i;
    return order;
  }

  // Keeps the longest segment of each cell.
  void keepOfEachCell() {
    struct Longest {
      double squared = -1;
      std::uint32_t point = 0;
    };
    std::unordered_map<std::uint32_t, Longest> of_cell;
    for (const NeuritePath& path : all_.paths) {
      if (path.isBall()) continue;
      Longest& longest = of_cell[path.cell];
      for (std::uint32_t k = path.begin + 1; k < path.begin + path.count; ++k) {
        const double squared = (all_.points[k].p - all_.points[k - 1].p).cast<double>().squaredNorm();
        if (squared > longest.squared) longest = {squared, k};
      }
    }
    for (const auto& [cell, longest] : of_cell) {  // in any order: painting commutes
      kept_[longest.point] = 1;
      paint(placesOf(longest.point - 1), placesOf(longest.point));
    }
  }

  Places placesOf(std::uint32_t point) const { return project_(at(all_.points[point].p)); }
  void paint(const Places& a, const Places& b) {
    for (std::size_t view = 0; view < kViews; ++view)
      masks_[view].trace(a[view], b[view], [&](std::size_t pixel) {
        masks_[view].set(pixel);
        return true;
      });
  }
  // True if the segment covers a pixel that was not covered; then covers its pixels.
  bool keepIfSeen(const Places& a, const Places& b) {
    bool covered = true;
    for (std::size_t view = 0; view < kViews && covered; ++view)
      covered = masks_[view].trace(a[view], b[view], [&](std::size_t pixel) { return masks_[view].isSet(pixel); });
    if (!covered) paint(a, b);
    return !covered;
  }

  void count(std::uint32_t point, bool is_ball, double pixel_um) {
    all_.represented -= all_.points[point].segments;
    all_.hidden += all_.points[point].segments;
    all_.pixel_um = std::max(all_.pixel_um, pixel_um);
    if (!is_ball) all_.hidden_um += lengthOf(point) * pixel_um;
  }

  Neurites& all_;
  double scale_;
  GridPoint origin_;
  std::vector<std::uint8_t> kept_;  // by point: the segment that ends there
  std::vector<Mask> masks_;
  Projection project_;
};

}  // namespace

void hide(Neurites& all, const Grid& grid, double pixel_um, bool every_cell) {
  if (all.points.empty()) return;
  Hider hider(all, grid, pixel_um);
  hider.choose(every_cell);
  hider.apply(pixel_um);
}

}  // namespace filiform
