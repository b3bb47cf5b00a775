#include "index/tile/packed_tree.h"

#include "index/errors.h"
#include "index/tile/internal/run_order.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cfloat>
#include <cmath>
#include <utility>

#if defined(__x86_64__) && defined(__GNUC__)
#define FILIFORM_AVX2 1
#define FILIFORM_AVX2_CODE __attribute__((target("avx2,bmi,popcnt")))
#include <immintrin.h>
#endif

namespace filiform {
namespace {

constexpr std::uint32_t kWidth = 8;
constexpr std::uint32_t kTopNodes = 16;
constexpr std::uint32_t kRun = internal::kRunSegments;
static_assert(2 * kRun == kWidth);
constexpr float kInfinity = std::numeric_limits<float>::infinity();

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
Node nothing() {
  Node node;
  for (std::size_t axis = 0; axis < 3; ++axis) node.lo[axis].fill(UINT16_MAX), node.hi[axis].fill(0);
  return node;
}

void joinPortable(const Node& below, Node& node, std::uint32_t lane) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    node.lo[axis][lane] = *std::min_element(below.lo[axis].begin(), below.lo[axis].end());
    node.hi[axis][lane] = *std::max_element(below.hi[axis].begin(), below.hi[axis].end());
  }
}

unsigned testPortable(const Node& node, const Probe& probe, float bound, float* squared) {
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

FILIFORM_AVX2_CODE unsigned testAvx2(const Node& node, const Probe& probe, float bound, float* squared) {
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
constexpr std::array<std::uint64_t, 256> kPlaces = [] {
  std::array<std::uint64_t, 256> places{};
  for (unsigned mask = 0; mask < 256; ++mask)
    for (unsigned bit = 0, at = 0; bit < 8; ++bit)
      if ((mask >> bit & 1) != 0) places[mask] |= std::uint64_t{bit} << (8 * at++);
  return places;
}();

constexpr std::uint32_t kBlock = 64;

// Boxes to search: nodes of one level, or runs. A mask selects some of eight boxes, which are appended without a
// branch.
struct BoxList {
  std::uint32_t size = 0;
  std::array<std::uint32_t, kBlock + kWidth> at;
  std::array<float, kBlock + kWidth> squared;  // distance

  bool full() const { return size > kBlock - kWidth; }
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
struct Chain {
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

FILIFORM_AVX2_CODE inline Axes narrowAxes(const std::uint16_t* offsets, const Chain& a, const Chain& b) {
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

FILIFORM_AVX2_CODE inline Axes wordAxes(const std::uint64_t* words, const Chain& a, const Chain& b) {
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

FILIFORM_AVX2_CODE inline Axes axesOf(const Offsets& offsets, const Chain& a, const Chain& b) {
  return offsets.narrow != nullptr ? narrowAxes(offsets.narrow, a, b) : wordAxes(offsets.words, a, b);
}

// The lanes after the last segment of each run.
FILIFORM_AVX2_CODE inline __m256i beyond(const Chain& a, const Chain& b) {
  const auto counts =
      both(_mm_set1_epi32(static_cast<std::int32_t>(a.count)), _mm_set1_epi32(static_cast<std::int32_t>(b.count)));
  return _mm256_cmpgt_epi32(_mm256_setr_epi32(1, 2, 3, 4, 1, 2, 3, 4), counts);
}

// Squared distances, in quanta, from the probe to the segments of two runs; infinite in unused lanes.
FILIFORM_AVX2_CODE inline __m256 sift(const Offsets& offsets, const Chain& a, const Chain& b,
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

FILIFORM_AVX2_CODE void joinAvx2(const Node& below, Node& node, std::uint32_t lane) {
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
FILIFORM_AVX2_CODE void boundAvx2(const Offsets& offsets, const Chain& a, const Chain& b, Node& node,
                                  std::uint32_t lane) {
  const Axes axes = narrowAxes(offsets.narrow, a, b);
  const __m256i none = beyond(a, b);
  boundAxis(axes.x, none, &node.lo[0][lane], &node.hi[0][lane]);
  boundAxis(axes.y, none, &node.lo[1][lane], &node.hi[1][lane]);
  boundAxis(axes.z, none, &node.lo[2][lane], &node.hi[2][lane]);
}
#endif

struct Path {
  Test test;
  Join join;
  bool eight;  // eight segments at once
};

#ifdef FILIFORM_AVX2
bool runsAvx2() {
  return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("bmi") && __builtin_cpu_supports("popcnt");
}
#endif

Path pathOf(const std::string& path) {
  if (path == "portable") return {testPortable, joinPortable, false};
#ifdef FILIFORM_AVX2
  if (path == "avx2" && runsAvx2()) return {testAvx2, joinAvx2, true};
#endif
  throw UsageError("the packed tree has no path \"" + path + "\" on this machine");
}

class PackedTree final : public TileEngine {
 public:
  PackedTree(std::shared_ptr<const Tile> tile, const Path& path)
      : tile_(std::move(tile)), path_(path), offsets_{tile_->narrowOffsets(), tile_->wordOffsets()} {
    build();
  }

  void search(const Vector3d& h_W, Candidates& best) const override;
  void collect(const Region& region, std::vector<std::uint32_t>& segments) const override;
  std::size_t bytes() const override { return sizeof *this + nodes_.size() * sizeof(Node); }

 private:
  friend class BlockSearch;

  // Levels from the leaves up: a node of level 0 holds the boxes of eight runs, a node of level l those of eight nodes
  // of level l - 1. The last level is small enough to scan.
  struct Level {
    std::uint32_t begin, children;  // its first node; number of boxes in all its nodes

    std::uint32_t nodes() const { return (children + kWidth - 1) / kWidth; }
  };

  // A probe, in units and quanta, with the bounds of float's error.
  struct Query {
    Probe probe;
    std::array<float, 3> near;  // the probe, in quanta
    float per_quantum;          // units a quantum: a power of two
    float sift_margin;          // quanta
    double per_unit2;           // um^2 a squared unit

    // Converts a squared distance in um^2 to units for box tests, rounded up.
    float boxBound(double squared) const {
      const double bound = squared * per_unit2;
      return bound < 1e37 ? static_cast<float>(bound * (1 + 0x1p-19)) + FLT_MIN : kInfinity;
    }
    // Converts a bound of boxes to quanta, for segment distances computed in float.
    float siftBound(float box_bound) const {
      const float far = std::sqrt(box_bound) * per_quantum * (1 + 0x1p-16f) + sift_margin;
      return far * far;
    }
    // An upper bound, um^2, of what closestPoint() reports for a distance computed in float.
    double surely(float sifted) const {
      const double far = (std::sqrt(double{sifted}) * (1 + 0x1p-16) + double{sift_margin}) / double{per_quantum};
      return far * far / per_unit2;
    }
  };

  [[gnu::always_inline]] inline Chain chainOf(std::uint32_t run) const {
    const SegmentRun r = runs_[run];
    return {tile_->child(r.begin()), tile_->parent(r.begin()), r.count()};
  }

  void build();
  void searchAll(const Vector3d& h_W, Candidates& best) const;
  void searchRun(std::uint32_t run, const Vector3d& h_W, Candidates& best) const;
  void searchOrdered(const Query& query, const Vector3d& h_W, Candidates& best) const;
  void offer(std::uint32_t run, std::uint32_t i, const Vector3d& h_W, Candidates& best) const {
    const Chain chain = chainOf(run);
    const std::uint32_t child = chain.child + i, parent = i == 0 ? chain.parent : child - 1;
    best.offer(*tile_, tile_->runs()[run].begin() + i, tile_->position_W(child), tile_->position_W(parent), h_W);
  }
  unsigned present(std::uint32_t level, std::uint32_t node) const {
    const std::uint32_t left = levels_[level].children - kWidth * node;
    return left >= kWidth ? 0xff : (1u << left) - 1;
  }

  std::shared_ptr<const Tile> tile_;
  Path path_;
  Offsets offsets_;
  const SegmentRun* runs_ = nullptr;
  std::uint32_t level_count_ = 0;
  std::array<Level, 11> levels_{};  // enough for 8^10 runs
  std::vector<Node> nodes_;
  double unit_um_ = 1, size_um_ = 0;  // size: the tile's largest coordinate
  Vector3d origin_W_ = Vector3d::Zero();
};

void PackedTree::build() {
  const std::span<const SegmentRun> runs = tile_->runs();
  if (runs.empty()) return;
  runs_ = runs.data();
  std::uint32_t nodes = 0;
  for (auto children = static_cast<std::uint32_t>(runs.size());;) {
    const Level& level = levels_[level_count_++] = {nodes, children};
    nodes += children = level.nodes();
    if (children <= kTopNodes) break;
  }
  nodes_.resize(nodes, nothing());

  // One bit is reserved for the carry of rounding up.
  const int shift = tile_->offset_bits() <= 16 ? 0 : tile_->offset_bits() - 15;
  const std::uint64_t up = (std::uint64_t{1} << shift) - 1;
  [[maybe_unused]] Chain before{};
  for (std::uint32_t r = 0; r < runs.size(); ++r) {
    Node& node = nodes_[r / kWidth];
#ifdef FILIFORM_AVX2
    if (path_.eight && tile_->offset_bits() <= 16) {
      const Chain chain = chainOf(r);
      if (r % 2 == 1)
        boundAvx2(offsets_, before, chain, node, r % kWidth - 1);
      else if (r + 1 == runs.size())
        boundAvx2(offsets_, chain, chain, node, r % kWidth);
      before = chain;
      continue;
    }
#endif
    Tile::Offset lo, hi;
    tile_->bound(runs[r], lo, hi);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      node.lo[axis][r % kWidth] = static_cast<std::uint16_t>(lo[axis] >> shift);
      node.hi[axis][r % kWidth] = static_cast<std::uint16_t>((hi[axis] + up) >> shift);
    }
  }
  for (std::uint32_t level = 1; level < level_count_; ++level)
    for (std::uint32_t child = 0; child < levels_[level].children; ++child)
      path_.join(nodes_[levels_[level - 1].begin + child], nodes_[levels_[level].begin + child / kWidth],
                 child % kWidth);

  const Grid grid = tile_->grid();
  unit_um_ = std::ldexp(grid.quantum_um(), shift);
  origin_W_ = grid.toWorld(tile_->origin());
  size_um_ = origin_W_.cwiseAbs().maxCoeff() + unit_um_ * 65536.0;
}

void PackedTree::searchRun(std::uint32_t run, const Vector3d& h_W, Candidates& best) const {
  const SegmentRun r = tile_->runs()[run];
  const Chain chain = chainOf(run);
  Vector3d parent_W = tile_->position_W(chain.parent);
  for (std::uint32_t i = 0; i < r.count(); ++i) {
    const Vector3d child_W = tile_->position_W(chain.child + i);
    best.offer(*tile_, r.begin() + i, child_W, parent_W, h_W);
    parent_W = child_W;
  }
}

void PackedTree::searchAll(const Vector3d& h_W, Candidates& best) const {
  for (std::uint32_t run = 0; run < tile_->runs().size(); ++run) searchRun(run, h_W, best);
}

#ifdef FILIFORM_AVX2
// Finds one nearest segment. First goes down to the eight runs with the nearest box, for a nearly exact bound. Then
// lists all boxes within the bound, level by level. Boxes are appended without a branch, since an unpredictable branch
// costs more than the test of eight boxes. Segment distances are computed in float, eight at once; closestPoint()
// measures the few segments that may be nearest.
class BlockSearch {
 public:
  FILIFORM_AVX2_CODE BlockSearch(const PackedTree& tree, const PackedTree::Query& query, const Vector3d& h_W,
                                 Candidates& best)
      : tree_(tree), query_(query), probe_(query.probe), h_W_(h_W), best_(best) {}

  FILIFORM_AVX2_CODE void run();

 private:
  static constexpr std::uint32_t kHits = 64;

  struct Hit {
    std::uint32_t run, segment;
    float squared;
  };

  // Searches boxes of nodes of a level, or of runs at level -1. Boxes much nearer than the bound come first, which
  // tightens the bound.
  FILIFORM_AVX2_CODE void visit(int level, BoxList& list) {
    if (level >= 0) return expand(level, list);
    BoxList near, far;
    list.split(bound_ * kMuchNearer, near);
    if (near.size > 0) siftAll(near);
    list.split(bound_, far);
    if (far.size > 0) siftAll(far);
  }
  FILIFORM_AVX2_CODE void expand(int level, const BoxList& nodes);
  FILIFORM_AVX2_CODE void siftAll(const BoxList& runs);
  void keep(const std::uint32_t* runs, unsigned lanes, const float* squared);
  void tighten(float squared) {
    least_ = squared;
    const double surely = query_.surely(squared);
    bound_ = std::min(bound_, query_.boxBound(best_.boundIf(surely)));
    kept_ = std::min(kept_, query_.siftBound(query_.boxBound(surely)));
  }

  static constexpr float kMuchNearer = 1.0f / 16;  // squared

  const PackedTree& tree_;
  const PackedTree::Query& query_;
  const WideProbe probe_;
  const Vector3d& h_W_;
  Candidates& best_;
  float bound_ = kInfinity;          // of boxes, units
  float kept_ = kInfinity;           // of segments, quanta: those that may be the nearest
  float least_ = kInfinity;          // smallest distance of a segment
  std::uint32_t done_ = UINT32_MAX;  // the node of level 0 searched first
  std::uint32_t hit_count_ = 0;
  std::array<Hit, kHits> hits_;
};

void BlockSearch::run() {
  bound_ = query_.boxBound(best_.bound2());
  kept_ = query_.siftBound(query_.boxBound(best_.limit2()));
  const std::uint32_t top = tree_.level_count_ - 1, count = tree_.levels_[top].nodes();
  alignas(32) std::array<float, kTopNodes * kWidth> squared;
  const Node* nodes = &tree_.nodes_[tree_.levels_[top].begin];
  __m256 nearest = _mm256_set1_ps(kInfinity);
  for (std::uint32_t n = 0; n < count; ++n) {
    const __m256 d = probe_.squaredTo(nodes[n]);
    _mm256_store_ps(&squared[kWidth * n], d);
    if (n + 1 < count) nearest = _mm256_min_ps(nearest, d);
  }
  for (std::uint32_t i = tree_.levels_[top].children; i < kWidth * count; ++i) squared[i] = kInfinity;
  nearest = _mm256_min_ps(nearest, _mm256_load_ps(&squared[kWidth * (count - 1)]));
  const float first = least(nearest);
  if (!(first <= bound_)) return;
  std::uint32_t at = 0;
  for (unsigned mask = 0;; at += kWidth)
    if ((mask = within(_mm256_load_ps(&squared[at]), first)) != 0) {
      at += static_cast<std::uint32_t>(std::countr_zero(mask));
      break;
    }
  for (std::uint32_t level = top; level > 0; --level) {
    const __m256 d = probe_.squaredTo(tree_.nodes_[tree_.levels_[level - 1].begin + at]);
    const __m256i lanes = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
    const auto children = static_cast<std::int32_t>(tree_.levels_[level - 1].children - kWidth * at);
    const __m256 absent = _mm256_castsi256_ps(_mm256_cmpgt_epi32(lanes, _mm256_set1_epi32(children - 1)));
    const __m256 there = _mm256_blendv_ps(d, _mm256_set1_ps(kInfinity), absent);
    at = kWidth * at + static_cast<std::uint32_t>(std::countr_zero(within(there, least(there))));
  }
  done_ = at / kWidth;
  BoxList list;
  list.append(kWidth * done_, _mm256_setzero_ps(), tree_.present(0, done_));
  siftAll(list);

  list.size = 0;
  for (std::uint32_t n = 0; n < count; ++n) {
    const __m256 d = _mm256_load_ps(&squared[kWidth * n]);
    unsigned mask = within(d, bound_);
    if (top == 0 && n == done_) mask = 0;
    list.append(kWidth * n, d, mask);
    if (list.full()) {
      visit(static_cast<int>(top) - 1, list);
      list.size = 0;
    }
  }
  visit(static_cast<int>(top) - 1, list);

  for (std::uint32_t i = 0; i < hit_count_; ++i)
    if (hits_[i].squared <= kept_) tree_.offer(hits_[i].run, hits_[i].segment, h_W_, best_);
}

void BlockSearch::expand(int level, const BoxList& nodes) {
  BoxList below;
  const auto l = static_cast<std::uint32_t>(level);
  const Node* at = &tree_.nodes_[tree_.levels_[l].begin];
  const std::uint32_t skipped = level == 0 ? done_ : UINT32_MAX;
  for (std::uint32_t i = 0; i < nodes.size; ++i) {
    const std::uint32_t node = nodes.at[i];
    const __m256 d = probe_.squaredTo(at[node]);
    const unsigned mask = within(d, bound_) & tree_.present(l, node);
    below.append(kWidth * node, d, node == skipped ? 0 : mask);
    if (below.full()) {
      visit(level - 1, below);
      below.size = 0;
    }
  }
  visit(level - 1, below);
}

void BlockSearch::siftAll(const BoxList& runs) {
  alignas(32) std::array<std::array<float, kWidth>, kBlock / 2 + kWidth> squared;
  __m256 all = _mm256_set1_ps(kInfinity);
  for (std::uint32_t i = 0; i < runs.size; i += 2) {
    const Chain a = tree_.chainOf(runs.at[i]);
    Chain b = a;
    if (i + 1 < runs.size)
      b = tree_.chainOf(runs.at[i + 1]);
    else
      b.count = 0;
    const __m256 d = sift(tree_.offsets_, a, b, query_.near);
    _mm256_store_ps(squared[i / 2].data(), d);
    all = _mm256_min_ps(all, d);
  }
  if (const float nearest = least(all); nearest < least_) tighten(nearest);
  for (std::uint32_t i = 0; i < runs.size; i += 2)
    if (const unsigned mask = within(_mm256_load_ps(squared[i / 2].data()), kept_); mask != 0)
      keep(&runs.at[i], mask, squared[i / 2].data());
}

// Keeps the hits of two runs.
void BlockSearch::keep(const std::uint32_t* runs, unsigned lanes, const float* squared) {
  for (; lanes != 0; lanes &= lanes - 1) {
    const auto lane = static_cast<std::uint32_t>(std::countr_zero(lanes));
    if (!(squared[lane] < kInfinity)) continue;
    if (hit_count_ == kHits) {  // many equal distances: measure them
      for (const Hit& hit : hits_)
        if (hit.squared <= kept_) tree_.offer(hit.run, hit.segment, h_W_, best_);
      hit_count_ = 0;
    }
    hits_[hit_count_++] = {runs[lane / kRun], lane % kRun, squared[lane]};
  }
}
#endif

void PackedTree::search(const Vector3d& h_W, Candidates& best) const {
  if (level_count_ == 0) return;
  // In units. The margin covers four times the rounding to float, and the error of closestPoint().
  const Vector3d h = (h_W - origin_W_) / unit_um_;
  const double reach = h.cwiseAbs().maxCoeff();
  if (!(reach < 1e15)) return searchAll(h_W, best);
  constexpr double kUlps = 16 * std::numeric_limits<double>::epsilon();
  const double margin =
      std::ldexp(reach, -22) + kUlps * (size_um_ + h_W.cwiseAbs().maxCoeff()) / unit_um_ + std::ldexp(1.0, -40);
  const double per_quantum = unit_um_ / tile_->grid().quantum_um();
  Query query;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double at = h[static_cast<Eigen::Index>(axis)];
    query.probe.lo[axis] = static_cast<float>(at - margin);
    query.probe.hi[axis] = static_cast<float>(at + margin);
    query.near[axis] = static_cast<float>(at * per_quantum);
  }
  query.per_quantum = static_cast<float>(per_quantum);
  // A coordinate errs by at most the margin and half a unit, and so does a point on a segment.
  query.sift_margin = static_cast<float>((margin * per_quantum + std::ldexp(1.0, tile_->offset_bits() - 18)) * 8);
  query.per_unit2 = 1 / (unit_um_ * unit_um_);
#ifdef FILIFORM_AVX2
  const bool lean = offsets_.narrow != nullptr || offsets_.words != nullptr;
  if (path_.eight && lean && best.single() && reach < 0x1p24) return BlockSearch(*this, query, h_W, best).run();
#endif
  searchOrdered(query, h_W, best);
}

// Searches with a queue, nearest boxes first.
void PackedTree::searchOrdered(const Query& query, const Vector3d& h_W, Candidates& best) const {
  struct Entry {
    float squared;
    std::uint32_t at;  // a node; at level kLeaf, a run
    std::uint32_t level;
  };
  constexpr std::uint32_t kLeaf = UINT32_MAX;
  std::array<Entry, (11 + kTopNodes) * kWidth> stack;
  std::uint32_t depth = 0;
  float bound = query.boxBound(best.bound2());
  const auto push = [&](std::uint32_t level, std::uint32_t at, std::uint32_t bottom) {
    alignas(32) std::array<float, kWidth> squared;
    unsigned within =
        path_.test(nodes_[levels_[level].begin + at], query.probe, bound, squared.data()) & present(level, at);
    for (; within != 0; within &= within - 1) {  // farthest first
      const auto i = static_cast<std::uint32_t>(std::countr_zero(within));
      std::uint32_t place = depth++;
      for (; place > bottom && stack[place - 1].squared < squared[i]; --place) stack[place] = stack[place - 1];
      stack[place] = {squared[i], kWidth * at + i, level == 0 ? kLeaf : level - 1};
    }
  };
  for (std::uint32_t at = 0; at < levels_[level_count_ - 1].nodes(); ++at) push(level_count_ - 1, at, 0);
  while (depth > 0) {
    const Entry top = stack[--depth];
    if (top.squared > bound) continue;
    if (top.level != kLeaf) {
      push(top.level, top.at, depth);
      continue;
    }
    searchRun(top.at, h_W, best);
    bound = query.boxBound(best.bound2());
  }
}

void PackedTree::collect(const Region& region, std::vector<std::uint32_t>& segments) const {
  if (level_count_ == 0) return;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> stack;
  for (std::uint32_t at = 0; at < levels_[level_count_ - 1].nodes(); ++at) stack.emplace_back(level_count_ - 1, at);
  while (!stack.empty()) {
    const auto [level, at] = stack.back();
    stack.pop_back();
    const Node& node = nodes_[levels_[level].begin + at];
    for (unsigned left = present(level, at); left != 0; left &= left - 1) {
      const auto i = static_cast<std::uint32_t>(std::countr_zero(left));
      const Vector3d lo(node.lo[0][i], node.lo[1][i], node.lo[2][i]), hi(node.hi[0][i], node.hi[1][i], node.hi[2][i]);
      if (!region.mayMeet({origin_W_ + unit_um_ * lo, origin_W_ + unit_um_ * hi})) continue;
      if (level > 0) {
        stack.emplace_back(level - 1, kWidth * at + i);
        continue;
      }
      const SegmentRun run = tile_->runs()[kWidth * at + i];
      for (std::uint32_t s = 0; s < run.count(); ++s) segments.push_back(run.begin() + s);
    }
  }
}

}  // namespace

std::vector<std::string> packedTreePaths() {
  std::vector<std::string> paths{"portable"};
#ifdef FILIFORM_AVX2
  if (runsAvx2()) paths.emplace_back("avx2");
#endif
  return paths;
}

std::unique_ptr<TileEngine> makePackedTree(std::shared_ptr<const Tile> tile, const std::string& path) {
  static const Path kFastest = pathOf(packedTreePaths().back());
  return std::make_unique<PackedTree>(std::move(tile), path.empty() ? kFastest : pathOf(path));
}

}  // namespace filiform
