#include "index/geometry/morton.h"

#include <algorithm>
#include <array>
#include <cstdlib>

namespace filiform {
namespace {

__extension__ using Wide = __int128;

constexpr std::int64_t kOffset = std::int64_t{1} << (kMortonAxisBits - 1);
constexpr int kHalfBits = kMortonAxisBits / 2;  // 21 bits an axis fill 63 bits of a word
constexpr std::uint64_t kHalfMask = (std::uint64_t{1} << kHalfBits) - 1;

constexpr int kPieceBits = 7;  // of the table of spread numbers
constexpr std::size_t kPieces = std::size_t{1} << kPieceBits;

constexpr std::array<std::uint32_t, kPieces> spreadPieces() {
  std::array<std::uint32_t, kPieces> pieces{};
  for (std::size_t v = 0; v < kPieces; ++v)
    for (int bit = 0; bit < kPieceBits; ++bit) pieces[v] |= static_cast<std::uint32_t>(v >> bit & 1) << (3 * bit);
  return pieces;
}
constexpr std::array<std::uint32_t, kPieces> kSpread = spreadPieces();

// Moves bit i of the lower 21 to bit 3 i.
std::uint64_t spread(std::uint64_t v) {
  const auto piece = [v](int i) { return std::uint64_t{kSpread[v >> (i * kPieceBits) & (kPieces - 1)]}; };
  return piece(0) | piece(1) << (3 * kPieceBits) | piece(2) << (6 * kPieceBits);
}

std::uint64_t gather(std::uint64_t v) {
  v &= 0x1249249249249249ull;
  v = (v | v >> 2) & 0x10C30C30C30C30C3ull;
  v = (v | v >> 4) & 0x100F00F00F00F00Full;
  v = (v | v >> 8) & 0x001F0000FF0000FFull;
  v = (v | v >> 16) & 0x001F00000000FFFFull;
  v = (v | v >> 32) & kHalfMask;
  return v;
}

// The lower halves of the axes.
std::uint64_t interleave(std::uint64_t x, std::uint64_t y, std::uint64_t z) {
  return spread(x) << 2 | spread(y) << 1 | spread(z);
}

std::array<std::uint64_t, 3> unsignedAxes(const GridPoint& p) {
  return {static_cast<std::uint64_t>(p[0] + kOffset), static_cast<std::uint64_t>(p[1] + kOffset),
          static_cast<std::uint64_t>(p[2] + kOffset)};
}

MortonKey upperHalf(const std::array<std::uint64_t, 3>& axes) {
  return MortonKey{interleave(axes[0] >> kHalfBits, axes[1] >> kHalfBits, axes[2] >> kHalfBits)} << (3 * kHalfBits);
}

}  // namespace

MortonKey mortonKey(const GridPoint& p) {
  const std::array<std::uint64_t, 3> axes = unsignedAxes(p);
  return upperHalf(axes) | interleave(axes[0], axes[1], axes[2]);
}

MortonKey MortonKeys::of(const GridPoint& p) {
  const std::array<std::uint64_t, 3> axes = unsignedAxes(p);
  const std::array<std::uint64_t, 3> upper{axes[0] >> kHalfBits, axes[1] >> kHalfBits, axes[2] >> kHalfBits};
  if (upper != upper_) {
    upper_ = upper;
    high_ = upperHalf(axes);
  }
  return high_ | interleave(axes[0], axes[1], axes[2]);
}

GridPoint mortonPoint(MortonKey key) {
  const auto high = static_cast<std::uint64_t>(key >> (3 * kHalfBits));
  const auto low = static_cast<std::uint64_t>(key);
  GridPoint p;
  for (int i = 0; i < 3; ++i)
    p[i] = static_cast<std::int64_t>(gather(high >> (2 - i)) << kHalfBits | gather(low >> (2 - i))) - kOffset;
  return p;
}

GridBox BlockKey::box() const { return {mortonPoint(low), mortonPoint(high())}; }

// Separating axes of a segment and a box: the box's three axes, and their cross products with the segment. Lengths are
// doubled so that centres are integers; the largest product is below 2^90.
bool segmentMeetsBox(const GridPoint& a, const GridPoint& b, const GridBox& box) {
  if (box.empty()) return false;
  const GridPoint d = b - a;
  const GridPoint extent = box.hi - box.lo;
  const GridPoint centre = (a + b) - (box.lo + box.hi);
  for (int i = 0; i < 3; ++i)
    if (std::abs(centre[i]) > extent[i] + std::abs(d[i])) return false;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    const Wide distance = Wide{centre[j]} * d[k] - Wide{centre[k]} * d[j];
    const Wide reach = Wide{extent[j]} * std::abs(d[k]) + Wide{extent[k]} * std::abs(d[j]);
    if ((distance < 0 ? -distance : distance) > reach) return false;
  }
  return true;
}

}  // namespace filiform
