#include "index/levels/internal/pictures.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include <Eigen/Geometry>

namespace filiform::internal {
namespace {

constexpr std::array<std::array<int, 3>, Pictures::kViews> kDirections{
    {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}, {1, 1, -1}, {1, -1, 1}, {-1, 1, 1}}};
constexpr int kPixelBits = 16, kSideBits = 3, kSquareBits = kPixelBits + kSideBits;
constexpr std::int32_t kSide = 1 << kSideBits;
constexpr std::uint64_t kFull = ~std::uint64_t{0};

}  // namespace

// The pixels of a segment but for its last, at most one pixel apart.
class Pictures::Line {
 public:
  Line(const Place& a, const Place& b) : at(a) {
    const std::int32_t x = b.x - a.x, y = b.y - a.y;
    steps = (std::max(std::abs(x), std::abs(y)) >> kPixelBits) + 1;
    step_ = {divided(x), divided(y)};
  }
  Place after(std::int32_t count) const { return {at.x + step_.x * count, at.y + step_.y * count}; }
  void advance(std::int32_t count) { at = after(count); }
  std::uint64_t bit() const {  // in its square
    return std::uint64_t{1} << ((at.y >> kPixelBits & (kSide - 1)) * kSide + (at.x >> kPixelBits & (kSide - 1)));
  }

  Place at;
  std::int32_t steps;

 private:
  std::int32_t divided(std::int32_t n) const {  // as integers are, in less time
    return static_cast<std::int32_t>(static_cast<double>(n) / static_cast<double>(steps));
  }
  Place step_;
};

void Pictures::Axis::set(std::size_t i, const Vector3d& axis, double begin_px) {
  x[i] = axis[0];
  y[i] = axis[1];
  z[i] = axis[2];
  begin[i] = begin_px;
}

Pictures::Pictures(const Vector3d& size) {
  const Vector3d half = size / 2;
  std::array<std::size_t, kViews> rows{};
  std::uint32_t widest = 0;
  for (std::size_t i = 0; i < kViews; ++i) {
    const auto& way = kDirections[i];
    const Vector3d d(way[0], way[1], way[2]);
    const Vector3d side = way[2] == 0 ? Vector3d::UnitZ() : Vector3d(way[1], -way[0], 0);
    const Vector3d right = side.squaredNorm() > 0 ? Vector3d(side / side.norm()) : Vector3d(Vector3d::UnitX());
    Vector3d up = d.cross(right);
    up /= up.norm();
    const double x = half.dot(right.cwiseAbs()), y = half.dot(up.cwiseAbs());
    right_.set(i, right, half.dot(right) - x - 1);
    up_.set(i, up, half.dot(up) - y - 1);
    widest = std::max(widest, static_cast<std::uint32_t>(2 * x + 4));
    rows[i] = (static_cast<std::size_t>(2 * y + 4) >> kSideBits) + 1;
  }
  row_bits_ = std::bit_width(widest >> kSideBits);
  std::size_t squares = 0;
  for (std::size_t i = 0; i < kViews; ++i) {
    begin_[i] = squares;
    squares += rows[i] << row_bits_;
  }
  squares_.assign(squares, 0);
}

std::size_t Pictures::square(const Place& p) const {
  return static_cast<std::size_t>(((p.y >> kSquareBits) << row_bits_) + (p.x >> kSquareBits));
}

bool Pictures::covered(const Places& a, const Places& b) const {
  std::array<std::int32_t, Places::kLanes> square_a, square_b, square_ab, square_ba, apart;
  for (std::size_t i = 0; i < Places::kLanes; ++i) {
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
    unknown |= (static_cast<unsigned>(all != kFull) | static_cast<unsigned>(apart[i])) << i;
  }
  for (; unknown != 0; unknown &= unknown - 1) {
    const auto i = static_cast<std::size_t>(std::countr_zero(unknown));
    if (!coversLine(squares_.data() + begin_[i], {a.x[i], a.y[i]}, {b.x[i], b.y[i]})) return false;
  }
  return true;
}

void Pictures::paint(const Places& a, const Places& b) {
  for (std::size_t i = 0; i < kViews; ++i) {
    std::uint64_t* squares = squares_.data() + begin_[i];
    const Place end{b.x[i], b.y[i]};
    Line line({a.x[i], a.y[i]}, end);
    for (std::int32_t k = 0; k < line.steps; ++k, line.advance(1)) squares[square(line.at)] |= line.bit();
    line.at = end;
    squares[square(end)] |= line.bit();
  }
}

bool Pictures::coversLine(const std::uint64_t* squares, const Place& a, const Place& b) const {
  Line line(a, b);
  for (std::int32_t left = line.steps; left > 0; left -= kSide) {
    const std::int32_t count = std::min(left, kSide);
    const Place end = line.after(count - 1);
    const std::uint64_t all = squares[square(line.at)] & squares[square(end)] & squares[square({line.at.x, end.y})] &
                              squares[square({end.x, line.at.y})];
    if (all == kFull) {
      line.advance(count);
      continue;
    }
    for (std::int32_t i = 0; i < count; ++i, line.advance(1))
      if ((squares[square(line.at)] & line.bit()) == 0) return false;
  }
  line.at = b;
  return (squares[square(b)] & line.bit()) != 0;
}

}  // namespace filiform::internal
