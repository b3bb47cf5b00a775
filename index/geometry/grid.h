// The fixed grid of all positions, and the world frame W: um, with the axes of the input or of the placement table.
//
// On disk, positions are integers: multiples of the quantum. In memory they are exact in double, so a node has
// identical coordinates wherever it is stored. Rounding to the grid is the only loss: at most half a quantum an axis
// (0.98 nm at the default). Thread rule: immutable values.
#pragma once

#include <cmath>
#include <cstdint>

#include <Eigen/Core>

namespace filiform {

using Eigen::Vector3d;
using GridPoint = Eigen::Matrix<std::int64_t, 3, 1>;  // quanta, frame W

struct GridBox {  // closed; empty if lo > hi on any axis
  GridPoint lo = GridPoint::Constant(INT64_MAX);
  GridPoint hi = GridPoint::Constant(INT64_MIN);

  bool empty() const { return (lo.array() > hi.array()).any(); }
  bool contains(const GridPoint& p) const {
    return p[0] >= lo[0] && p[0] <= hi[0] && p[1] >= lo[1] && p[1] <= hi[1] && p[2] >= lo[2] && p[2] <= hi[2];
  }
  bool containsInside(const GridPoint& p) const {  // not on its border
    return p[0] > lo[0] && p[0] < hi[0] && p[1] > lo[1] && p[1] < hi[1] && p[2] > lo[2] && p[2] < hi[2];
  }
  // By coordinates, so that compilers inline them: ingest extends several boxes for each segment.
  void extend(const GridPoint& p) {
    for (int i = 0; i < 3; ++i) {
      lo[i] = p[i] < lo[i] ? p[i] : lo[i];
      hi[i] = p[i] > hi[i] ? p[i] : hi[i];
    }
  }
  void extend(const GridBox& b) {
    for (int i = 0; i < 3; ++i) {
      lo[i] = b.lo[i] < lo[i] ? b.lo[i] : lo[i];
      hi[i] = b.hi[i] > hi[i] ? b.hi[i] : hi[i];
    }
  }
};

class Grid {
 public:
  // W_RANGE reports a value read with |x| > kMaxInput_um, and drops a sample whose |x| exceeds kMaxCoordinate_um after
  // unit, offset and placement.
  static constexpr double kMaxInput_um = 1e9;
  static constexpr double kMaxCoordinate_um = 1073741824.0;  // 2^30
  static constexpr int kDefaultExponent = -9;
  // Bounds that make coordinates fit the 42 bits an axis of a MortonKey.
  static constexpr int kMinExponent = -10, kMaxExponent = 10;

  // The quantum is 2^exponent um. Requires kMinExponent <= exponent <= kMaxExponent.
  explicit Grid(int exponent = kDefaultExponent)
      : exponent_(exponent), quantum_um_(std::ldexp(1.0, exponent)), per_um_(std::ldexp(1.0, -exponent)) {}

  int exponent() const { return exponent_; }
  double quantum_um() const { return quantum_um_; }

  // The nearest grid point; ties round away from zero. Requires finite |p| <= kMaxCoordinate_um on each axis.
  GridPoint snap(const Vector3d& p_W) const {
    return GridPoint(rounded(p_W.x() * per_um_), rounded(p_W.y() * per_um_), rounded(p_W.z() * per_um_));
  }
  // The position in um, exact.
  Vector3d toWorld(const GridPoint& p) const { return p.cast<double>() * quantum_um_; }

 private:
  // As std::llround(), without a call. Requires |v| below 2^52.
  static std::int64_t rounded(double v) {
    const auto whole = static_cast<std::int64_t>(v);
    const double rest = v - static_cast<double>(whole);
    return whole + (rest >= 0.5 ? 1 : 0) - (rest <= -0.5 ? 1 : 0);
  }

  int exponent_;
  double quantum_um_, per_um_;
};

}  // namespace filiform
