#include "index/levels/internal/pixel_cover.h"

#include <cmath>

namespace filiform::internal {
namespace {

constexpr int kCoverSquareBits = 3;

std::uint64_t squareOf(std::int64_t x, std::int64_t y) {
  return static_cast<std::uint64_t>(x >> kCoverSquareBits) << 32 | static_cast<std::uint32_t>(y >> kCoverSquareBits);
}

std::uint64_t bitOf(std::int64_t x, std::int64_t y) {
  constexpr std::int64_t kInside = (1 << kCoverSquareBits) - 1;
  return std::uint64_t{1} << ((y & kInside) << kCoverSquareBits | (x & kInside));
}

}  // namespace

void PixelCover::View::set(std::int64_t x, std::int64_t y) { squares[squareOf(x, y)] |= bitOf(x, y); }

bool PixelCover::View::has(std::int64_t x, std::int64_t y) {
  const std::uint64_t square = squareOf(x, y);
  if (!is_known || square != last) {
    const auto found = squares.find(square);
    last = square;
    word = found == squares.end() ? 0 : found->second;
    is_known = true;
  }
  return (word & bitOf(x, y)) != 0;
}

void PixelCover::add(const Vector3d& a_W, const Vector3d& b_W) {
  using Pixel = Eigen::Matrix<std::int64_t, 3, 1>;
  const auto steps = static_cast<std::int64_t>((b_W - a_W).cwiseAbs().maxCoeff() / pixel_um_ * 2) + 1;
  Pixel last = Pixel::Constant(INT64_MAX);
  for (std::int64_t i = 0; i <= steps; ++i) {
    const Vector3d p_W = a_W + (b_W - a_W) * (static_cast<double>(i) / static_cast<double>(steps));
    const Pixel at = (p_W / pixel_um_).array().floor().cast<std::int64_t>();
    if (at == last) continue;
    last = at;
    for (int v = 0; v < 3; ++v) views_[static_cast<std::size_t>(v)].set(at[v], at[(v + 1) % 3]);
  }
}

bool PixelCover::hides(const Vector3d& p_W) {
  for (int v = 0; v < 3; ++v) {
    View& view = views_[static_cast<std::size_t>(v)];
    const auto x = static_cast<std::int64_t>(std::floor(p_W[v] / pixel_um_)),
               y = static_cast<std::int64_t>(std::floor(p_W[(v + 1) % 3] / pixel_um_));
    bool found = view.has(x, y);
    for (int around = 0; around < 9 && !found; ++around) found = view.has(x + around % 3 - 1, y + around / 3 - 1);
    if (!found) return false;
  }
  return true;
}

}  // namespace filiform::internal
