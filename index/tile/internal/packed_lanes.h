// Eight boxes or eight segments at once, in the vectors of the instruction set for which packed_boxes.cpp is being
// compiled. That source includes this header once for each. Thread rule: functions without state.
#include "index/tile/internal/packed_boxes.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <hwy/highway.h>

#if defined(FILIFORM_PACKED_LANES) == defined(HWY_TARGET_TOGGLE)
#ifdef FILIFORM_PACKED_LANES
#undef FILIFORM_PACKED_LANES
#else
#define FILIFORM_PACKED_LANES
#endif

HWY_BEFORE_NAMESPACE();
namespace filiform::internal::packed::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

// Eight lanes in one vector, or in two of four. A vector holds whole runs: lane i of a block of four is the run's i-th
// segment.
using TagF = hn::CappedTag<float, kWidth>;
using TagI = hn::RebindToSigned<TagF>;
using TagU = hn::RebindToUnsigned<TagF>;
using TagU16 = hn::Repartition<std::uint16_t, TagF>;
using TagU64 = hn::Repartition<std::uint64_t, TagF>;
using TagBytes = hn::Repartition<std::uint8_t, TagF>;
using VecF = hn::Vec<TagF>;
using VecI = hn::Vec<TagI>;
using VecU = hn::Vec<TagU>;
using VecU16 = hn::Vec<TagU16>;
using VecU64 = hn::Vec<TagU64>;
constexpr std::size_t kLanes = hn::MaxLanes(TagF());
constexpr std::size_t kParts = kWidth / kLanes;
constexpr unsigned kPartMask = (1u << kLanes) - 1;
static_assert(kLanes == 4 || kLanes == 8);

struct Floats {
  HWY_INLINE Floats() {}  // has the instruction set of this source, unlike an implicit constructor
  VecF part[kParts];
};

HWY_INLINE Floats filled(float value) {
  Floats all;
  for (std::size_t p = 0; p < kParts; ++p) all.part[p] = hn::Set(TagF(), value);
  return all;
}
HWY_INLINE Floats loaded(const float* at) {
  Floats all;
  for (std::size_t p = 0; p < kParts; ++p) all.part[p] = hn::LoadU(TagF(), at + p * kLanes);
  return all;
}
HWY_INLINE void store(const Floats& from, float* to) {
  for (std::size_t p = 0; p < kParts; ++p) hn::StoreU(from.part[p], TagF(), to + p * kLanes);
}
HWY_INLINE Floats least(const Floats& a, const Floats& b) {
  Floats all;
  for (std::size_t p = 0; p < kParts; ++p) all.part[p] = hn::Min(a.part[p], b.part[p]);
  return all;
}
HWY_INLINE float least(const Floats& v) {
  VecF all = v.part[0];
  for (std::size_t p = 1; p < kParts; ++p) all = hn::Min(all, v.part[p]);
  return hn::GetLane(hn::MinOfLanes(TagF(), all));
}

// One bit for each lane that is at most `bound`.
HWY_INLINE unsigned within(const Floats& squared, float bound) {
  const VecF most = hn::Set(TagF(), bound);
  unsigned bits = 0;
  for (std::size_t p = 0; p < kParts; ++p) {
    std::uint8_t some[8] = {};
    hn::StoreMaskBits(TagF(), hn::Le(squared.part[p], most), some);
    bits |= unsigned{some[0]} << (p * kLanes);
  }
  return bits;
}

HWY_INLINE VecF sum3(VecF x, VecF y, VecF z) { return hn::Add(hn::Add(x, y), z); }

// A probe repeated in every lane.
struct WideProbe {
  VecF lo[3], hi[3];

  HWY_INLINE explicit WideProbe(const Query& q) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      lo[axis] = hn::Set(TagF(), q.lo[axis]), hi[axis] = hn::Set(TagF(), q.hi[axis]);
  }
  HWY_INLINE VecF squaredGap(const Node& node, std::size_t axis, std::size_t p) const {
    const hn::Rebind<std::uint16_t, TagF> narrow;
    const VecI node_lo = hn::PromoteTo(TagI(), hn::Load(narrow, node.lo[axis].data() + p * kLanes));
    const VecI node_hi = hn::PromoteTo(TagI(), hn::Load(narrow, node.hi[axis].data() + p * kLanes));
    const VecF below = hn::Sub(hn::ConvertTo(TagF(), node_lo), hi[axis]);
    const VecF above = hn::Sub(lo[axis], hn::ConvertTo(TagF(), node_hi));
    const VecF gap = hn::Max(hn::Max(below, above), hn::Zero(TagF()));
    return hn::Mul(gap, gap);
  }
  // Squared distances, in units, to the boxes, rounded down except for the last places.
  HWY_INLINE Floats squaredTo(const Node& node) const {
    Floats all;
    for (std::size_t p = 0; p < kParts; ++p)
      all.part[p] = sum3(squaredGap(node, 0, p), squaredGap(node, 1, p), squaredGap(node, 2, p));
    return all;
  }
};

// Puts infinity into the lanes from `count` on.
HWY_INLINE Floats present(const Floats& squared, std::uint32_t count) {
  Floats all;
  const VecI last = hn::Set(TagI(), static_cast<std::int32_t>(std::min(count, kWidth)) - 1);
  for (std::size_t p = 0; p < kParts; ++p) {
    const VecI lanes = hn::Iota(TagI(), static_cast<std::int32_t>(p * kLanes));
    const auto absent = hn::RebindMask(TagF(), hn::Gt(lanes, last));
    all.part[p] = hn::IfThenElse(absent, hn::Set(TagF(), kInfinity), squared.part[p]);
  }
  return all;
}

// For each set of bits: the bytes that move the lanes of these bits to the front, then any others. Highway has such
// tables in functions, where g++ copies them at each call.
struct Selections {
  static constexpr std::size_t kSets = std::size_t{1} << kLanes, kBytes = kLanes == 8 ? 8 : 16;
  alignas(16) std::array<std::uint8_t, kSets * kBytes> of{};

  constexpr Selections() {
    for (std::size_t set = 0; set < kSets; ++set)
      for (std::size_t lane = 0, at = 0; lane < kLanes; ++lane) {
        if ((set >> lane & 1) == 0) continue;
        for (std::size_t byte = 0; byte < kBytes / kLanes; ++byte, ++at)
          of[set * kBytes + at] = static_cast<std::uint8_t>(kBytes / kLanes * lane + byte);
      }
  }
};
constexpr Selections kSelections;

template <class V>
HWY_INLINE V selected(V all, unsigned mask) {
  [[maybe_unused]] const std::uint8_t* const bytes = &kSelections.of[mask * Selections::kBytes];
#if HWY_TARGET == HWY_AVX3
  const std::uint8_t bits[8] = {static_cast<std::uint8_t>(mask)};
  return hn::Compress(all, hn::LoadMaskBits(hn::DFromV<V>(), bits));
#elif HWY_TARGET == HWY_AVX2
  const VecI lanes = hn::PromoteTo(TagI(), hn::LoadU(hn::Rebind<std::uint8_t, TagI>(), bytes));
  return hn::TableLookupLanes(all, hn::IndicesFromVec(hn::DFromV<V>(), lanes));
#else
  return hn::BitCast(hn::DFromV<V>(), hn::TableLookupBytes(hn::BitCast(TagBytes(), all), hn::Load(TagBytes(), bytes)));
#endif
}

// Processors with four lanes may lack an instruction for this.
HWY_INLINE std::uint32_t ones(unsigned mask) {
  static constexpr std::uint8_t kOnes[16] = {0, 1, 1, 2, 1, 2, 2, 3, 1, 2, 2, 3, 2, 3, 3, 4};
  return kLanes == 4 ? kOnes[mask] : static_cast<std::uint32_t>(std::popcount(mask));
}

// The coordinates of the children and of the parents of a part's runs.
struct Axis {
  VecI child, parent;
};
struct Axes {
  Axis x, y, z;
};

// Eight numbers of 16 bits of each of the part's runs.
HWY_INLINE VecU16 loadBlocks(const std::uint16_t* a, const std::uint16_t* b, std::size_t p) {
#if HWY_TARGET == HWY_AVX2 || HWY_TARGET == HWY_AVX3
  const hn::Half<TagU16> half;
  return (void)p, hn::Combine(TagU16(), hn::LoadU(half, b), hn::LoadU(half, a));
#else
  return hn::LoadU(TagU16(), p == 0 ? a : b);
#endif
}
// The same number in all lanes of a run.
template <class D>
HWY_INLINE hn::Vec<D> perRun(D d, hn::TFromD<D> a, hn::TFromD<D> b, std::size_t p) {
#if HWY_TARGET == HWY_AVX2 || HWY_TARGET == HWY_AVX3
  const hn::Half<D> half;
  return (void)p, hn::Combine(d, hn::Set(half, b), hn::Set(half, a));
#else
  return hn::Set(d, p == 0 ? a : b);
#endif
}

// Each parent except the first is the child before. `first` has the first parent in its last lanes.
HWY_INLINE Axis axisOf(VecU child, VecU first) {
  const VecU parent = hn::BitCast(TagU(), hn::CombineShiftRightBytes<12>(TagBytes(), hn::BitCast(TagBytes(), child),
                                                                         hn::BitCast(TagBytes(), first)));
  return {hn::BitCast(TagI(), child), hn::BitCast(TagI(), parent)};
}

constexpr std::uint8_t kZero = 0x80;  // gives a byte of zero
// Extracts 16 bits each from these bytes of a block, as 32-bit lanes.
template <std::uint8_t a, std::uint8_t b, std::uint8_t c, std::uint8_t d>
HWY_INLINE VecU lanesOf(VecU16 block) {
  alignas(16) static constexpr std::uint8_t kBytes[16] = {a, a + 1, kZero, kZero, b, b + 1, kZero, kZero,
                                                          c, c + 1, kZero, kZero, d, d + 1, kZero, kZero};
  return hn::BitCast(TagU(),
                     hn::TableLookupBytesOr0(hn::BitCast(TagBytes(), block), hn::LoadDup128(TagBytes(), kBytes)));
}
// The points of a part's runs, and the lanes after the last segment of each run.
struct Points {
  Axes axes;
  hn::Mask<TagI> beyond;
};

HWY_INLINE hn::Mask<TagI> beyond(VecU counts) {
  alignas(16) static constexpr std::int32_t kPlaces[4] = {1, 2, 3, 4};
  return hn::Gt(hn::LoadDup128(TagI(), kPlaces), hn::BitCast(TagI(), counts));
}

// x0 to x3 and y0 to y3; z0 to z3, the parent and the count.
HWY_INLINE Points pointsOf(const NarrowRun& a, const NarrowRun& b, std::size_t p) {
  const VecU16 xy = loadBlocks(a.x.data(), b.x.data(), p), rest = loadBlocks(a.z.data(), b.z.data(), p);
  return {{axisOf(lanesOf<0, 2, 4, 6>(xy), lanesOf<8, 8, 8, 8>(rest)),
           axisOf(lanesOf<8, 10, 12, 14>(xy), lanesOf<10, 10, 10, 10>(rest)),
           axisOf(lanesOf<0, 2, 4, 6>(rest), lanesOf<12, 12, 12, 12>(rest))},
          beyond(lanesOf<14, 14, 14, 14>(rest))};
}

HWY_INLINE VecU lowHalves(VecU64 low, VecU64 high) {
  return hn::ConcatEven(TagU(), hn::BitCast(TagU(), high), hn::BitCast(TagU(), low));
}

HWY_INLINE Points pointsOf(const WordRun& a, const WordRun& b, std::size_t p) {
  constexpr int kBits = WordOffsets<const std::uint64_t>::kBits;
  const VecU64 mask = hn::Set(TagU64(), WordOffsets<const std::uint64_t>::kMask);
  // Each vector holds half of the part's children.
  const WordRun& run = p == 0 ? a : b;
  const VecU64 low = hn::LoadU(TagU64(), run.child.data());
  const VecU64 high = hn::LoadU(TagU64(), kParts == 1 ? b.child.data() : run.child.data() + kLanes / 2);
  const VecU64 first = perRun(TagU64(), a.parent, b.parent, p), counts = perRun(TagU64(), a.count, b.count, p);
  const auto firstOf = [](VecU64 v) HWY_ATTR { return hn::DupEven(hn::BitCast(TagU(), v)); };
  return {{axisOf(lowHalves(hn::And(low, mask), hn::And(high, mask)), firstOf(hn::And(first, mask))),
           axisOf(lowHalves(hn::And(hn::ShiftRight<kBits>(low), mask), hn::And(hn::ShiftRight<kBits>(high), mask)),
                  firstOf(hn::And(hn::ShiftRight<kBits>(first), mask))),
           axisOf(lowHalves(hn::ShiftRight<2 * kBits>(low), hn::ShiftRight<2 * kBits>(high)),
                  firstOf(hn::ShiftRight<2 * kBits>(first)))},
          beyond(firstOf(counts))};
}

// Along one axis: from the child to the probe and to the parent.
struct Reach {
  VecF to, along;
};
HWY_INLINE Reach reachOf(const Axis& axis, float h) {
  const VecF at = hn::ConvertTo(TagF(), axis.child);
  return {hn::Sub(hn::Set(TagF(), h), at), hn::Sub(hn::ConvertTo(TagF(), axis.parent), at)};
}
HWY_INLINE VecF squared(VecF v) { return hn::Mul(v, v); }

// Squared distances, in quanta, from the probe to the segments of two runs; infinite in unused lanes.
template <class Run>
HWY_INLINE Floats sift(const Run& a, const Run& b, const std::array<float, 3>& h) {
  Floats all;
  for (std::size_t p = 0; p < kParts; ++p) {
    const Points points = pointsOf(a, b, p);
    const Reach x = reachOf(points.axes.x, h[0]), y = reachOf(points.axes.y, h[1]), z = reachOf(points.axes.z, h[2]);
    const VecF length2 = sum3(squared(x.along), squared(y.along), squared(z.along));
    const VecF projected = sum3(hn::Mul(x.to, x.along), hn::Mul(y.to, y.along), hn::Mul(z.to, z.along));
    const VecF one = hn::Set(TagF(), 1.0f);
    // A segment of length 0 gives 0 / 1.
    const VecF t = hn::Min(hn::Max(hn::Div(projected, hn::Max(length2, one)), hn::Zero(TagF())), one);
    const VecF distance2 =
        sum3(squared(hn::Sub(x.to, hn::Mul(t, x.along))), squared(hn::Sub(y.to, hn::Mul(t, y.along))),
             squared(hn::Sub(z.to, hn::Mul(t, z.along))));
    all.part[p] = hn::IfThenElse(hn::RebindMask(TagF(), points.beyond), hn::Set(TagF(), kInfinity), distance2);
  }
  return all;
}

}  // namespace
}  // namespace filiform::internal::packed::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
