// hide() of neurites.h.
#include "index/tile/internal/neurites.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numeric>
#include <optional>
#include <unordered_map>

#include <Eigen/Geometry>

namespace filiform {
namespace {

constexpr std::size_t kViews = 7;
constexpr std::size_t kLanes =
    8;  // loops have the length of whole vectors, which compilers then use; one lane is unused
constexpr int kPixelBits = 16, kSquareBits = kPixelBits + 3;

// The places of a point in all pictures, in 2^-16 of a pixel.
struct Places {
  std::array<std::int32_t, kLanes> x, y;
};

// A direction to look from.
struct View {
  Vector3d right, up;
  double left, bottom, width, height;  // of the picture, in pixels
};

std::array<View, kViews> viewsOf(const Vector3d& size) {
  static constexpr std::array<std::array<int, 3>, kViews> kDirections{
      {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}, {1, 1, -1}, {1, -1, 1}, {-1, 1, 1}}};
  std::array<View, kViews> views;
  for (std::size_t i = 0; i < kViews; ++i) {
    View& view = views[i];
    const auto& way = kDirections[i];
    const Vector3d d(way[0], way[1], way[2]);
    const Vector3d side = way[2] == 0 ? Vector3d::UnitZ() : Vector3d(way[1], -way[0], 0);
    view.right = side.squaredNorm() > 0 ? Vector3d(side / side.norm()) : Vector3d(Vector3d::UnitX());
    const Vector3d up = d.cross(view.right);
    view.up = up / up.norm();
    const Vector3d half = size / 2;
    const double x = half.dot(view.right.cwiseAbs()), y = half.dot(view.up.cwiseAbs());
    view.left = half.dot(view.right) - x - 1;
    view.bottom = half.dot(view.up) - y - 1;
    view.width = 2 * x + 4;
    view.height = 2 * y + 4;
  }
  return views;
}

class Projection {
 public:
  explicit Projection(const std::array<View, kViews>& views) {
    for (std::size_t i = 0; i < kViews; ++i) {
      set(i, views[i].right, views[i].left);
      set(kLanes + i, views[i].up, views[i].bottom);
    }
  }
  Places operator()(const Vector3d& p) const {
    constexpr double kOne = 1 << kPixelBits;
    Places places;
    for (std::size_t i = 0; i < kLanes; ++i)
      places.x[i] = static_cast<std::int32_t>((p[0] * x_[i] + (p[1] * y_[i] + p[2] * z_[i]) - begin_[i]) * kOne);
    for (std::size_t i = 0, k = kLanes; i < kLanes; ++i, ++k)
      places.y[i] = static_cast<std::int32_t>((p[0] * x_[k] + (p[1] * y_[k] + p[2] * z_[k]) - begin_[k]) * kOne);
    return places;
  }

 private:
  void set(std::size_t lane, const Vector3d& axis, double begin) {
    x_[lane] = axis[0];
    y_[lane] = axis[1];
    z_[lane] = axis[2];
    begin_[lane] = begin;
  }
  std::array<double, 2 * kLanes> x_{}, y_{}, z_{}, begin_{};
};

// Pictures of a block from all directions: which pixels are covered. A word holds a square of 8 x 8 pixels, so that
// four words tell whether all pixels of a short segment are covered, as they are in most of dense tissue.
class Pictures {
 public:
  explicit Pictures(const std::array<View, kViews>& views) {
    double width = 0, height = 0;
    for (const View& view : views) {
      width = std::max(width, view.width);
      height = std::max(height, view.height);
    }
    row_bits_ = std::bit_width(static_cast<std::uint32_t>(width) >> (kSquareBits - kPixelBits));
    std::size_t size = 0;
    for (std::size_t i = 0; i < kViews; ++i) {
      begin_[i] = size;
      size += ((static_cast<std::size_t>(views[i].height) >> (kSquareBits - kPixelBits)) + 1) << row_bits_;
    }
    squares_.assign(size, 0);
  }

  // True if all pixels of a segment are covered in all pictures.
  bool cover(const Places& a, const Places& b) const {
    std::array<std::int32_t, kLanes> square_a, square_b, square_ab, square_ba, apart;
    for (std::size_t i = 0; i < kLanes; ++i) {
      const std::int32_t ax = a.x[i] >> kSquareBits, ay = a.y[i] >> kSquareBits;
      const std::int32_t bx = b.x[i] >> kSquareBits, by = b.y[i] >> kSquareBits;
      square_a[i] = (ay << row_bits_) + ax;
      square_b[i] = (by << row_bits_) + bx;
      square_ab[i] = (ay << row_bits_) + bx;
      square_ba[i] = (by << row_bits_) + ax;
      apart[i] = ((ax - bx + 1) | (bx - ax + 1) | (ay - by + 1) | (by - ay + 1)) < 0;  // by more than one square
    }
    unsigned unknown = 0;
    for (std::size_t i = 0; i < kViews; ++i) {
      const std::uint64_t* squares = squares_.data() + begin_[i];
      const std::uint64_t all =
          squares[square_a[i]] & squares[square_b[i]] & squares[square_ab[i]] & squares[square_ba[i]];
      unknown |= ((all != ~std::uint64_t{0}) | static_cast<unsigned>(apart[i])) << i;
    }
    for (; unknown != 0; unknown &= unknown - 1) {
      const auto i = static_cast<std::size_t>(std::countr_zero(unknown));
      if (!coversLine(squares_.data() + begin_[i], {a.x[i], a.y[i]}, {b.x[i], b.y[i]})) return false;
    }
    return true;
  }
  void paint(const Places& a, const Places& b) {
    for (std::size_t i = 0; i < kViews; ++i) {
      std::uint64_t* squares = squares_.data() + begin_[i];
      const Place end{b.x[i], b.y[i]};
      Line line({a.x[i], a.y[i]}, end);
      for (std::int32_t k = 0; k < line.steps; ++k, line.advance(1)) squares[square(line.at)] |= bit(line.at);
      squares[square(end)] |= bit(end);
    }
  }

 private:
  struct Place {
    std::int32_t x, y;
  };
  struct Line {  // its pixels but for the last, at most one pixel apart
    Line(const Place& a, const Place& b) : at(a) {
      const std::int32_t x = b.x - a.x, y = b.y - a.y;
      steps = (std::max(std::abs(x), std::abs(y)) >> kPixelBits) + 1;
      step = {divided(x), divided(y)};
    }
    void advance(std::int32_t count) {
      at.x += step.x * count;
      at.y += step.y * count;
    }
    std::int32_t divided(std::int32_t n) const {  // as integers are, in less time
      return static_cast<std::int32_t>(static_cast<double>(n) / static_cast<double>(steps));
    }
    Place at, step;
    std::int32_t steps;
  };

  std::size_t square(const Place& p) const {
    return static_cast<std::size_t>(((p.y >> kSquareBits) << row_bits_) + (p.x >> kSquareBits));
  }
  static std::uint64_t bit(const Place& p) {
    return std::uint64_t{1} << ((p.y >> kPixelBits & 7) << 3 | (p.x >> kPixelBits & 7));
  }
  bool coversLine(const std::uint64_t* squares, const Place& a, const Place& b) const {
    constexpr std::int32_t kSide = 8;
    Line line(a, b);
    for (std::int32_t left = line.steps; left > 0; left -= kSide) {
      const std::int32_t count = std::min(left, kSide);
      const Place end{line.at.x + line.step.x * (count - 1), line.at.y + line.step.y * (count - 1)};
      const std::uint64_t all = squares[square(line.at)] & squares[square(end)] & squares[square({line.at.x, end.y})] &
                                squares[square({end.x, line.at.y})];
      if (all == ~std::uint64_t{0}) {
        line.advance(count);
        continue;
      }
      for (std::int32_t i = 0; i < count; ++i, line.advance(1))
        if ((squares[square(line.at)] & bit(line.at)) == 0) return false;
    }
    return (squares[square(b)] & bit(b)) != 0;
  }

  int row_bits_ = 0;                         // a row has 2^row_bits_ squares
  std::array<std::size_t, kViews> begin_{};  // of each picture
  std::vector<std::uint64_t> squares_;
};

class Hider {
 public:
  Hider(Neurites& all, const Grid& grid, double pixel_um)
      : all_(all), scale_(grid.quantum_um() / pixel_um), kept_(all.points.size(), 0) {
    GridBox box;
    for (const NeuritePoint& point : all.points) box.extend(point.p);
    origin_ = box.lo;
    const std::array<View, kViews> views = viewsOf(at(box.hi));
    project_.emplace(views);
    pictures_.emplace(views);
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
      pictures_->paint(placesOf(longest.point - 1), placesOf(longest.point));
    }
  }

  Places placesOf(std::uint32_t point) const { return (*project_)(at(all_.points[point].p)); }
  // True if the segment covers a pixel that was not covered; then covers its pixels.
  bool keepIfSeen(const Places& a, const Places& b) {
    if (pictures_->cover(a, b)) return false;
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
  std::optional<Projection> project_;
  std::optional<Pictures> pictures_;
};

}  // namespace

void hide(Neurites& all, const Grid& grid, double pixel_um, bool every_cell) {
  if (all.points.empty()) return;
  Hider hider(all, grid, pixel_um);
  hider.choose(every_cell);
  hider.apply(pixel_um);
}

}  // namespace filiform
