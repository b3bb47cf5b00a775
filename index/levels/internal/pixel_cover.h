// PixelCover: the pixels that segments cover, seen along the three axes.
#pragma once

#include "index/geometry/grid.h"

#include <array>
#include <cstdint>
#include <unordered_map>

namespace filiform::internal {

// Thread rule: externally synchronised.
class PixelCover {
 public:
  explicit PixelCover(double pixel_um) : pixel_um_(pixel_um) {}

  void add(const Vector3d& a_W, const Vector3d& b_W);  // O(pixels of the segment)
  // True if, along each axis, the pixel of the point or one of the 8 around it is covered. O(1).
  bool hides(const Vector3d& p_W);

 private:
  // A word holds a square of 8 x 8 pixels. Most queries ask for the square of the last one.
  struct View {
    std::unordered_map<std::uint64_t, std::uint64_t> squares;
    std::uint64_t last = ~std::uint64_t{0}, word = 0;
    bool is_known = false;

    void set(std::int64_t x, std::int64_t y);
    bool has(std::int64_t x, std::int64_t y);
  };
  double pixel_um_;
  std::array<View, 3> views_;  // along z, x, y
};

}  // namespace filiform::internal
