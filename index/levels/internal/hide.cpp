// hide() of neurites.h.
#include "index/levels/internal/neurites.h"
#include "index/levels/internal/pictures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>
#include <unordered_map>

namespace filiform {
namespace {

using internal::Places;

class Hider {
 public:
  Hider(Neurites& all, const Grid& grid, double pixel_um)
      : all_(all), scale_(grid.quantum_um() / pixel_um), kept_(all.points.size(), 0) {
    GridBox box;
    for (const NeuritePoint& point : all.points) box.extend(point.p);
    origin_ = box.lo;
    pictures_.emplace(at(box.hi));
  }

  void choose(bool every_cell) {
    if (every_cell) keepOfEachCell();
    constexpr std::size_t kPathsAhead = 16, kPointsAhead = 8;
    const std::vector<std::uint32_t> order = longestFirst();
    for (std::size_t at = 0; at < order.size(); ++at) {
      // Paths of one length lie far apart in memory. (In a function of its own, GCC removes prefetches.)
      if (at + kPathsAhead < order.size()) __builtin_prefetch(&all_.paths[order[at + kPathsAhead]]);
      if (at + kPointsAhead < order.size()) {
        const NeuritePath& path = all_.paths[order[at + kPointsAhead]];
        __builtin_prefetch(&all_.points[path.begin]);
        __builtin_prefetch(&all_.points[path.begin + path.count - 1]);
        __builtin_prefetch(&kept_[path.begin]);
      }
      const NeuritePath& path = all_.paths[order[at]];
      Places last = placesOf(path.begin);
      if (path.isBall()) kept_[path.begin] = every_cell || keepIfSeen(last, last) ? 1 : 0;
      for (std::uint32_t k = 1; k < path.count; ++k) {
        const Places next = placesOf(path.begin + k);
        if (kept_[path.begin + k] == 0) kept_[path.begin + k] = keepIfSeen(last, next) ? 1 : 0;
        last = next;
      }
    }
  }

  void apply(double pixel_um, std::span<std::size_t> bounds) {
    for (const NeuritePath& path : all_.paths)
      for (std::uint32_t k = path.isBall() ? 0 : 1; k < path.count; ++k)
        if (kept_[path.begin + k] == 0) count(path.begin + k, path.isBall(), pixel_um);
    cutOut(all_, kept_, bounds);
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
      pictures_->paint(placesOf(longest.point - 1), placesOf(longest.point));
    }
  }

  Places placesOf(std::uint32_t point) const { return pictures_->placesOf(at(all_.points[point].p)); }
  // True if the segment covers a pixel that was not covered; then covers its pixels.
  bool keepIfSeen(const Places& a, const Places& b) {
    if (pictures_->covered(a, b)) return false;
    pictures_->paint(a, b);
    return true;
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
  std::optional<internal::Pictures> pictures_;
};

}  // namespace

void hide(Neurites& all, const Grid& grid, double pixel_um, bool every_cell, std::span<std::size_t> bounds) {
  if (all.points.empty()) return;
  Hider hider(all, grid, pixel_um);
  hider.choose(every_cell);
  hider.apply(pixel_um, bounds);
}

}  // namespace filiform
