// hide() of neurites.h.
#include "index/tile/internal/neurites.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

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
  Place place(const Vector3d& p) const {
    constexpr double kOne = 65536;
    return {static_cast<std::int32_t>((p.dot(right_) - left_) * kOne),
            static_cast<std::int32_t>((p.dot(up_) - bottom_) * kOne)};
  }
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

class Hider {
 public:
  Hider(Neurites& all, const Grid& grid, double pixel_um)
      : all_(all), scale_(grid.quantum_um() / pixel_um), kept_(all.points.size(), 0) {
    GridBox box;
    for (const NeuritePoint& point : all.points) box.extend(point.p);
    origin_ = box.lo;
    masks_ = masksOf(Vector3d::Zero(), at(box.hi));
  }

  void choose(bool every_cell) {
    std::vector<std::pair<double, std::uint32_t>> order;
    for (std::uint32_t i = 0; i < all_.paths.size(); ++i) {
      const NeuritePath& path = all_.paths[i];
      double length = 0;
      for (std::uint32_t k = 1; k < path.count; ++k) length += lengthOf(path.begin + k);
      order.emplace_back(length, i);
    }
    std::sort(order.begin(), order.end(), [](const auto& a, const auto& b) {
      return a.first != b.first ? a.first > b.first : a.second < b.second;
    });
    if (every_cell) keepOfEachCell();
    for (const auto& [length, i] : order) {
      const NeuritePath& path = all_.paths[i];
      if (path.isBall()) kept_[path.begin] = every_cell || keepIfSeen(path.begin, path.begin) ? 1 : 0;
      for (std::uint32_t k = 1; k < path.count; ++k)
        if (kept_[path.begin + k] == 0) kept_[path.begin + k] = keepIfSeen(path.begin + k - 1, path.begin + k) ? 1 : 0;
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

  void keepOfEachCell() {
    std::vector<std::pair<double, std::uint32_t>> longest;  // by order of cells met
    std::uint32_t cell = UINT32_MAX;
    std::vector<std::uint32_t> order(all_.paths.size());
    for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
    std::stable_sort(order.begin(), order.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return all_.paths[a].cell < all_.paths[b].cell; });
    for (const std::uint32_t i : order) {
      const NeuritePath& path = all_.paths[i];
      if (path.cell != cell) longest.emplace_back(-1, 0);
      cell = path.cell;
      for (std::uint32_t k = 1; k < path.count; ++k)
        if (const double length = lengthOf(path.begin + k); length > longest.back().first)
          longest.back() = {length, path.begin + k};
    }
    for (const auto& [length, point] : longest)
      if (length >= 0) {
        kept_[point] = 1;
        paint(point - 1, point);
      }
  }

  void paint(std::uint32_t from, std::uint32_t to) {
    const Vector3d a = at(all_.points[from].p), b = at(all_.points[to].p);
    for (Mask& mask : masks_)
      mask.trace(mask.place(a), mask.place(b), [&](std::size_t pixel) {
        mask.set(pixel);
        return true;
      });
  }
  // True if the segment covers a pixel that was not covered; then covers its pixels.
  bool keepIfSeen(std::uint32_t from, std::uint32_t to) {
    const Vector3d a = at(all_.points[from].p), b = at(all_.points[to].p);
    const bool covered = std::all_of(masks_.begin(), masks_.end(), [&](const Mask& mask) {
      return mask.trace(mask.place(a), mask.place(b), [&](std::size_t pixel) { return mask.isSet(pixel); });
    });
    if (!covered) paint(from, to);
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
};

}  // namespace

void hide(Neurites& all, const Grid& grid, double pixel_um, bool every_cell) {
  if (all.points.empty()) return;
  Hider hider(all, grid, pixel_um);
  hider.choose(every_cell);
  hider.apply(pixel_um);
}

}  // namespace filiform
