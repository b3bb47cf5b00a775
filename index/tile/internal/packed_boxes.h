// The vector code of the packed tree: tests of eight boxes at once, boxes and distances of the segments of two runs.
// Only packed_tree.cpp includes this header. Each function has a portable form, or is used on the AVX2 path alone.
// Thread rule: functions without state.
#pragma once

#include "index/geometry/offsets.h"
#include "index/tile/internal/run_order.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <utility>

#if defined(__x86_64__) && defined(__GNUC__)
#define FILIFORM_AVX2 1
#define FILIFORM_AVX2_CODE __attribute__((target("avx2,bmi,popcnt")))
#define FILIFORM_AVX2_INLINE __attribute__((target("avx2,bmi,popcnt"), always_inline)) inline
#include <immintrin.h>
#endif

namespace filiform::internal::packed {

inline constexpr std::uint32_t kWidth = 8;
inline constexpr std::uint32_t kRun = kRunSegments;
static_assert(2 * kRun == kWidth);
inline constexpr float kInfinity = std::numeric_limits<float>::infinity();

// The boxes of up to eight children, in units from the tile's origin.
struct alignas(32) Node {
  std::array<std::array<std::uint16_t, kWidth>, 3> lo, hi;
};

// A probe in units, as a small box that surely contains it: float rounds, and closestPoint() rounds too.
struct Probe {
  std::array<float, 3> lo, hi;
};

// Computes squared distances, in units, from the probe to the boxes, rounded down except for the last places. Returns
// one bit for each box within `bound`.
using Test = unsigned (*)(const Node& node, const Probe& probe, float bound, float* squared);

// Joins the boxes of all children of `below` into one box of `node`.
using Join = void (*)(const Node& below, Node& node, std::uint32_t lane);

// Empty lanes are neutral under join.
inline Node nothing() {
  Node node;
  for (std::size_t axis = 0; axis < 3; ++axis) node.lo[axis].fill(UINT16_MAX), node.hi[axis].fill(0);
  return node;
}

inline void joinPortable(const Node& below, Node& node, std::uint32_t lane) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    node.lo[axis][lane] = *std::min_element(below.lo[axis].begin(), below.lo[axis].end());
    node.hi[axis][lane] = *std::max_element(below.hi[axis].begin(), below.hi[axis].end());
  }
}

inline unsigned testPortable(const Node& node, const Probe& probe, float bound, float* squared) {
  for (std::uint32_t i = 0; i < kWidth; ++i) squared[i] = 0;
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (std::uint32_t i = 0; i < kWidth; ++i) {
      const float below = static_cast<float>(node.lo[axis][i]) - probe.hi[axis];
      const float above = probe.lo[axis] - static_cast<float>(node.hi[axis][i]);
      const float gap = std::max(std::max(below, above), 0.0f);
      squared[i] += gap * gap;
    }
  unsigned within = 0;
  for (std::uint32_t i = 0; i < kWidth; ++i) within |= static_cast<unsigned>(squared[i] <= bound) << i;
  return within;
}

// A tile's offset arrays: at most one is not null.
struct Offsets {
  const std::uint16_t* narrow;
  const std::uint64_t* words;
};

#ifdef FILIFORM_AVX2
FILIFORM_AVX2_CODE inline __m256 widened(__m128i lanes) { return _mm256_cvtepi32_ps(_mm256_cvtepu16_epi32(lanes)); }

FILIFORM_AVX2_CODE inline __m256 squaredGap(const std::array<std::uint16_t, kWidth>& lo,
                                            const std::array<std::uint16_t, kWidth>& hi, __m256 probe_lo,
                                            __m256 probe_hi) {
  const __m256 below = _mm256_sub_ps(widened(_mm_load_si128(reinterpret_cast<const __m128i*>(lo.data()))), probe_hi);
  const __m256 above = _mm256_sub_ps(probe_lo, widened(_mm_load_si128(reinterpret_cast<const __m128i*>(hi.data()))));
  const __m256 gap = _mm256_max_ps(_mm256_max_ps(below, above), _mm256_setzero_ps());
  return _mm256_mul_ps(gap, gap);
}

FILIFORM_AVX2_CODE inline __m256 sum3(__m256 x, __m256 y, __m256 z) { return _mm256_add_ps(_mm256_add_ps(x, y), z); }

// A probe repeated in every lane.
struct WideProbe {
  __m256 lo_x, hi_x, lo_y, hi_y, lo_z, hi_z;

  FILIFORM_AVX2_CODE explicit WideProbe(const Probe& p)
      : lo_x(_mm256_set1_ps(p.lo[0])),
        hi_x(_mm256_set1_ps(p.hi[0])),
        lo_y(_mm256_set1_ps(p.lo[1])),
        hi_y(_mm256_set1_ps(p.hi[1])),
        lo_z(_mm256_set1_ps(p.lo[2])),
        hi_z(_mm256_set1_ps(p.hi[2])) {}
  FILIFORM_AVX2_CODE __m256 squaredTo(const Node& node) const {
    return sum3(squaredGap(node.lo[0], node.hi[0], lo_x, hi_x), squaredGap(node.lo[1], node.hi[1], lo_y, hi_y),
                squaredGap(node.lo[2], node.hi[2], lo_z, hi_z));
  }
};

FILIFORM_AVX2_CODE inline unsigned within(__m256 squared, float bound) {
  return static_cast<unsigned>(_mm256_movemask_ps(_mm256_cmp_ps(squared, _mm256_set1_ps(bound), _CMP_LE_OQ)));
}

FILIFORM_AVX2_CODE inline unsigned testAvx2(const Node& node, const Probe& probe, float bound, float* squared) {
  const __m256 sum = WideProbe(probe).squaredTo(node);
  _mm256_storeu_ps(squared, sum);
  return within(sum, bound);
}

FILIFORM_AVX2_CODE inline float least(__m256 v) {
  __m128 m = _mm_min_ps(_mm256_castps256_ps128(v), _mm256_extractf128_ps(v, 1));
  m = _mm_min_ps(m, _mm_movehl_ps(m, m));
  return _mm_cvtss_f32(_mm_min_ss(m, _mm_movehdup_ps(m)));
}

// For each byte: the positions of its set bits, ascending, one byte each.
inline constexpr std::array<std::uint64_t, 256> kPlaces = [] {
  std::array<std::uint64_t, 256> places{};
  for (unsigned mask = 0; mask < 256; ++mask)
    for (unsigned bit = 0, at = 0; bit < 8; ++bit)
      if ((mask >> bit & 1) != 0) places[mask] |= std::uint64_t{bit} << (8 * at++);
  return places;
}();

inline constexpr std::uint32_t kListBoxes = 64;

// Boxes to search: nodes of one level, or runs. A mask selects some of eight boxes, which are appended without a
// branch.
struct BoxList {
  std::uint32_t size = 0;
  std::array<std::uint32_t, kListBoxes + kWidth> at;
  std::array<float, kListBoxes + kWidth> squared;  // distance

  bool full() const { return size > kListBoxes - kWidth; }
  // Appends those of the boxes first, first + 1 ... whose bit is set.
  FILIFORM_AVX2_CODE void append(std::uint32_t first, __m256 distances, unsigned mask) {
    append(_mm256_add_epi32(_mm256_set1_epi32(static_cast<std::int32_t>(first)),
                            _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7)),
           distances, mask);
  }
  FILIFORM_AVX2_CODE void append(__m256i boxes, __m256 distances, unsigned mask) {
    const __m256i places = _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(static_cast<std::int64_t>(kPlaces[mask])));
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(&at[size]), _mm256_permutevar8x32_epi32(boxes, places));
    _mm256_storeu_ps(&squared[size], _mm256_permutevar8x32_ps(distances, places));
    size += static_cast<std::uint32_t>(__builtin_popcount(mask));
  }
  // Moves the boxes within the bound to `near`.
  FILIFORM_AVX2_CODE void split(float bound, BoxList& near) {
    std::uint32_t left = 0;
    for (std::uint32_t i = 0; i < size; i += kWidth) {
      const __m256i boxes = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(&at[i]));
      const __m256 distances = _mm256_loadu_ps(&squared[i]);
      const unsigned there = size - i >= kWidth ? 0xff : (1u << (size - i)) - 1,
                     mask = within(distances, bound) & there;
      near.append(boxes, distances, mask);
      const std::uint32_t all = std::exchange(size, left);
      append(boxes, distances, ~mask & there);
      left = std::exchange(size, all);
    }
    size = left;
  }
};

// A run: the nodes of its first segment, and the number of segments.
struct RunEnds {
  std::uint32_t child, parent, count;
};

// One axis of two runs, four lanes each.
struct Axis {
  __m256i child, parent;
};
struct Axes {
  Axis x, y, z;
};

FILIFORM_AVX2_CODE inline __m256i both(__m128i first, __m128i last) {
  return _mm256_inserti128_si256(_mm256_castsi128_si256(first), last, 1);
}
FILIFORM_AVX2_CODE inline __m128i loaded(const std::uint16_t* at) {
  return _mm_loadu_si128(reinterpret_cast<const __m128i*>(at));
}
// Each parent except the first is the child before. `first` has the first parent in its last lanes.
FILIFORM_AVX2_CODE inline Axis axisOf(__m256i child, __m256i first) {
  return {child, _mm256_alignr_epi8(child, first, 12)};
}

// Shuffles that extract 16 bits each from these bytes.
FILIFORM_AVX2_CODE inline __m256i toLanes(char a, char b, char c, char d) {
  return _mm256_broadcastsi128_si256(_mm_setr_epi8(a, static_cast<char>(a + 1), -1, -1, b, static_cast<char>(b + 1), -1,
                                                   -1, c, static_cast<char>(c + 1), -1, -1, d, static_cast<char>(d + 1),
                                                   -1, -1));
}
FILIFORM_AVX2_CODE inline __m256i toLast(char a) {
  return _mm256_broadcastsi128_si256(
      _mm_setr_epi8(-1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, a, static_cast<char>(a + 1), -1, -1));
}

FILIFORM_AVX2_CODE inline Axes narrowAxes(const std::uint16_t* offsets, const RunEnds& a, const RunEnds& b) {
  const std::uint16_t *at_a = offsets + 3 * std::size_t{a.child}, *at_b = offsets + 3 * std::size_t{b.child};
  // x0 y0 z0 x1 y1 z1 x2 y2, and y1 z1 x2 y2 z2 x3 y3 z3. Where both are needed, no axis is in the same lane of both.
  const __m256i low = both(loaded(at_a), loaded(at_b)), high = both(loaded(at_a + 4), loaded(at_b + 4));
  const __m256i first = both(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(offsets + 3 * std::size_t{a.parent})),
                             _mm_loadl_epi64(reinterpret_cast<const __m128i*>(offsets + 3 * std::size_t{b.parent})));
  return {axisOf(_mm256_shuffle_epi8(_mm256_blend_epi16(low, high, 0b00100000), toLanes(0, 6, 12, 10)),
                 _mm256_shuffle_epi8(first, toLast(0))),
          axisOf(_mm256_shuffle_epi8(_mm256_blend_epi16(low, high, 0b01000000), toLanes(2, 8, 14, 12)),
                 _mm256_shuffle_epi8(first, toLast(2))),
          axisOf(_mm256_shuffle_epi8(_mm256_blend_epi16(low, high, 0b10010000), toLanes(4, 10, 8, 14)),
                 _mm256_shuffle_epi8(first, toLast(4)))};
}

// The low halves of two vectors of four words.
FILIFORM_AVX2_CODE inline __m256i lowHalves(__m256i a, __m256i b) {
  const __m256 mixed = _mm256_shuffle_ps(_mm256_castsi256_ps(a), _mm256_castsi256_ps(b), 0b10001000);
  return _mm256_permute4x64_epi64(_mm256_castps_si256(mixed), 0b11011000);
}

FILIFORM_AVX2_INLINE Axes wordAxes(const std::uint64_t* words, const RunEnds& a, const RunEnds& b) {
  constexpr int kBits = WordOffsets<const std::uint64_t>::kBits;
  const __m256i at_a = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(words + a.child));
  const __m256i at_b = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(words + b.child));
  const __m256i first = both(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(words + a.parent)),
                             _mm_loadl_epi64(reinterpret_cast<const __m128i*>(words + b.parent)));
  const __m256i mask = _mm256_set1_epi64x(static_cast<std::int64_t>(WordOffsets<const std::uint64_t>::kMask));
  const __m256i y_a = _mm256_srli_epi64(at_a, kBits), y_b = _mm256_srli_epi64(at_b, kBits);
  const __m256i z_a = _mm256_srli_epi64(at_a, 2 * kBits), z_b = _mm256_srli_epi64(at_b, 2 * kBits);
  return {axisOf(lowHalves(_mm256_and_si256(at_a, mask), _mm256_and_si256(at_b, mask)),
                 _mm256_shuffle_epi32(_mm256_and_si256(first, mask), 0)),
          axisOf(lowHalves(_mm256_and_si256(y_a, mask), _mm256_and_si256(y_b, mask)),
                 _mm256_shuffle_epi32(_mm256_and_si256(_mm256_srli_epi64(first, kBits), mask), 0)),
          axisOf(lowHalves(z_a, z_b), _mm256_shuffle_epi32(_mm256_srli_epi64(first, 2 * kBits), 0))};
}

FILIFORM_AVX2_INLINE Axes axesOf(const Offsets& offsets, const RunEnds& a, const RunEnds& b) {
  return offsets.narrow != nullptr ? narrowAxes(offsets.narrow, a, b) : wordAxes(offsets.words, a, b);
}

// The lanes after the last segment of each run.
FILIFORM_AVX2_CODE inline __m256i beyond(const RunEnds& a, const RunEnds& b) {
  const auto counts =
      both(_mm_set1_epi32(static_cast<std::int32_t>(a.count)), _mm_set1_epi32(static_cast<std::int32_t>(b.count)));
  return _mm256_cmpgt_epi32(_mm256_setr_epi32(1, 2, 3, 4, 1, 2, 3, 4), counts);
}

// Squared distances, in quanta, from the probe to the segments of two runs; infinite in unused lanes.
FILIFORM_AVX2_INLINE __m256 sift(const Offsets& offsets, const RunEnds& a, const RunEnds& b,
                                 const std::array<float, 3>& h) {
  const Axes axes = axesOf(offsets, a, b);
  const __m256 at_x = _mm256_cvtepi32_ps(axes.x.child), at_y = _mm256_cvtepi32_ps(axes.y.child),
               at_z = _mm256_cvtepi32_ps(axes.z.child);
  const __m256 along_x = _mm256_sub_ps(_mm256_cvtepi32_ps(axes.x.parent), at_x),
               along_y = _mm256_sub_ps(_mm256_cvtepi32_ps(axes.y.parent), at_y),
               along_z = _mm256_sub_ps(_mm256_cvtepi32_ps(axes.z.parent), at_z);
  const __m256 to_x = _mm256_sub_ps(_mm256_set1_ps(h[0]), at_x), to_y = _mm256_sub_ps(_mm256_set1_ps(h[1]), at_y),
               to_z = _mm256_sub_ps(_mm256_set1_ps(h[2]), at_z);
  const __m256 length2 =
      sum3(_mm256_mul_ps(along_x, along_x), _mm256_mul_ps(along_y, along_y), _mm256_mul_ps(along_z, along_z));
  const __m256 projected =
      sum3(_mm256_mul_ps(to_x, along_x), _mm256_mul_ps(to_y, along_y), _mm256_mul_ps(to_z, along_z));
  // A segment of length 0 gives 0 / 1.
  __m256 t = _mm256_div_ps(projected, _mm256_max_ps(length2, _mm256_set1_ps(1.0f)));
  t = _mm256_min_ps(_mm256_max_ps(t, _mm256_setzero_ps()), _mm256_set1_ps(1.0f));
  const __m256 dx = _mm256_sub_ps(to_x, _mm256_mul_ps(t, along_x)), dy = _mm256_sub_ps(to_y, _mm256_mul_ps(t, along_y)),
               dz = _mm256_sub_ps(to_z, _mm256_mul_ps(t, along_z));
  return _mm256_blendv_ps(sum3(_mm256_mul_ps(dx, dx), _mm256_mul_ps(dy, dy), _mm256_mul_ps(dz, dz)),
                          _mm256_set1_ps(kInfinity), _mm256_castsi256_ps(beyond(a, b)));
}

FILIFORM_AVX2_CODE inline void joinAvx2(const Node& below, Node& node, std::uint32_t lane) {
  const __m128i all = _mm_set1_epi16(-1);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const __m128i lo = _mm_load_si128(reinterpret_cast<const __m128i*>(below.lo[axis].data()));
    const __m128i hi = _mm_load_si128(reinterpret_cast<const __m128i*>(below.hi[axis].data()));
    node.lo[axis][lane] = static_cast<std::uint16_t>(_mm_extract_epi16(_mm_minpos_epu16(lo), 0));
    node.hi[axis][lane] = static_cast<std::uint16_t>(~_mm_extract_epi16(_mm_minpos_epu16(_mm_xor_si128(hi, all)), 0));
  }
}

FILIFORM_AVX2_CODE inline void boundAxis(const Axis& axis, __m256i beyond, std::uint16_t* lo, std::uint16_t* hi) {
  // Unused lanes get the first child.
  const __m256i child = _mm256_blendv_epi8(axis.child, _mm256_shuffle_epi32(axis.child, 0), beyond);
  const __m256i parent = _mm256_blendv_epi8(axis.parent, _mm256_shuffle_epi32(axis.parent, 0), beyond);
  __m256i least = _mm256_min_epu32(child, parent), most = _mm256_max_epu32(child, parent);
  least = _mm256_min_epu32(least, _mm256_shuffle_epi32(least, 0b01001110));
  most = _mm256_max_epu32(most, _mm256_shuffle_epi32(most, 0b01001110));
  least = _mm256_min_epu32(least, _mm256_shuffle_epi32(least, 0b10110001));
  most = _mm256_max_epu32(most, _mm256_shuffle_epi32(most, 0b10110001));
  lo[0] = static_cast<std::uint16_t>(_mm256_extract_epi16(least, 0));
  lo[1] = static_cast<std::uint16_t>(_mm256_extract_epi16(least, 8));
  hi[0] = static_cast<std::uint16_t>(_mm256_extract_epi16(most, 0));
  hi[1] = static_cast<std::uint16_t>(_mm256_extract_epi16(most, 8));
}

// The boxes of two consecutive runs of a node, for offsets of up to 16 bits.
FILIFORM_AVX2_CODE inline void boundAvx2(const Offsets& offsets, const RunEnds& a, const RunEnds& b, Node& node,
                                         std::uint32_t lane) {
  const Axes axes = narrowAxes(offsets.narrow, a, b);
  const __m256i none = beyond(a, b);
  boundAxis(axes.x, none, &node.lo[0][lane], &node.hi[0][lane]);
  boundAxis(axes.y, none, &node.lo[1][lane], &node.hi[1][lane]);
  boundAxis(axes.z, none, &node.lo[2][lane], &node.hi[2][lane]);
}
#endif

}  // namespace filiform::internal::packed
