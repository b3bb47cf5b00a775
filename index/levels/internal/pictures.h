// Pictures of a block from 7 directions, along the axes and diagonals of a cube: which of their pixels are covered.
// They are orthographic. Thread rule: externally synchronised.
#pragma once

#include "index/geometry/grid.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace filiform::internal {

// The places of a point in all pictures, in 2^-16 of a pixel. One lane is unused: loops then have the length of whole
// vectors, which compilers use.
struct Places {
  static constexpr std::size_t kLanes = 8;
  std::array<std::int32_t, kLanes> x, y;
};

class Pictures {
 public:
  static constexpr std::size_t kViews = 7;

  // Empty pictures of a box from 0 to `size`, in pixels of at most 2048 an axis. O(pixels / 64).
  explicit Pictures(const Vector3d& size);

  // Of a point in the box, in pixels. O(1).
  Places placesOf(const Vector3d& p) const {
    Places places;
    for (std::size_t i = 0; i < Places::kLanes; ++i) places.x[i] = right_.place(p, i);
    for (std::size_t i = 0; i < Places::kLanes; ++i) places.y[i] = up_.place(p, i);
    return places;
  }

  // True if all pixels of a segment are covered in all pictures. O(pixels of the segment), usually O(1).
  bool covered(const Places& a, const Places& b) const;
  // Covers the pixels of a segment. O(pixels of the segment).
  void paint(const Places& a, const Places& b);

 private:
  struct Place {
    std::int32_t x, y;
  };
  class Line;
  struct Axis {  // of all pictures
    std::array<double, Places::kLanes> x{}, y{}, z{}, begin{};

    std::int32_t place(const Vector3d& p, std::size_t i) const {
      constexpr double kOne = 65536;
      return static_cast<std::int32_t>((p[0] * x[i] + (p[1] * y[i] + p[2] * z[i]) - begin[i]) * kOne);
    }
    void set(std::size_t i, const Vector3d& axis, double begin_px);
  };

  std::size_t square(const Place& p) const;
  bool coversLine(const std::uint64_t* squares, const Place& a, const Place& b) const;

  Axis right_, up_;
  int row_bits_ = 0;                         // a row has 2^row_bits_ squares
  std::array<std::size_t, kViews> begin_{};  // of each picture
  // A word holds a square of 8 x 8 pixels: four words tell whether all pixels of a short segment are covered, as they
  // are in most of dense tissue.
  std::vector<std::uint64_t> squares_;
};

}  // namespace filiform::internal
