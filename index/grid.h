// The fixed grid that every position lies on, and the world frame W.
//
// World positions are integers (multiples of the quantum) on disk, and exact in double in memory, so the same node has
// identical coordinates wherever it appears. Rounding to the grid is the only loss: at most half a quantum an axis
// (0.98 nm at the default). Immutable values.
#pragma once

#include <cmath>
#include <cstdint>

#include <Eigen/Core>

namespace filiform {

using Eigen::Vector3d;
using GridPoint = Eigen::Matrix<std::int64_t, 3, 1>;  // quanta, frame W

struct GridBox {  // closed; empty when lo > hi on any axis
  GridPoint lo = GridPoint::Constant(INT64_MAX);
  GridPoint hi = GridPoint::Constant(INT64_MIN);

  bool empty() const { return (lo.array() > hi.array()).any(); }
  void extend(const GridPoint& p) {
    lo = lo.cwiseMin(p);
    hi = hi.cwiseMax(p);
  }
  void extend(const GridBox& b) {
    lo = lo.cwiseMin(b.lo);
    hi = hi.cwiseMax(b.hi);
  }
};

class Grid {
 public:
  // As read, |x| > kMaxInput_um is W_RANGE; after unit, offset and placement, |x| > kMaxCoordinate_um drops the sample
  // too.
  static constexpr double kMaxInput_um = 1e9;
  static constexpr double kMaxCoordinate_um = 1073741824.0;  // 2^30
  static constexpr int kDefaultExponent = -9;
  // Coordinates must fit the 42 bits an axis of a MortonKey.
  static constexpr int kMinExponent = -10, kMaxExponent = 10;

  // The quantum is 2^exponent um. Requires kMinExponent <= exponent <= kMaxExponent.
  explicit Grid(int exponent = kDefaultExponent) : exponent_(exponent), quantum_um_(std::ldexp(1.0, exponent)) {}

  int exponent() const { return exponent_; }
  double quantum_um() const { return quantum_um_; }

  // Nearest grid point (ties away from zero). Requires finite |p| <= kMaxCoordinate_um on each axis.
  GridPoint snap(const Vector3d& p_W) const {
    return GridPoint(std::llround(std::ldexp(p_W.x(), -exponent_)), std::llround(std::ldexp(p_W.y(), -exponent_)),
                     std::llround(std::ldexp(p_W.z(), -exponent_)));
  }
  // Exact.
  Vector3d toWorld(const GridPoint& p) const { return p.cast<double>() * quantum_um_; }

 private:
  int exponent_;
  double quantum_um_;
};

}  // namespace filiform
