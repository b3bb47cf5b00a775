#include "index/tile/internal/step_sums.h"

#include <algorithm>
#include <array>
#include <vector>

// As in packed_boxes.cpp.
#define HWY_BROKEN_EMU128 0
#define HWY_BROKEN_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "index/tile/internal/step_sums.cpp"
// clang-format off
#include <hwy/foreach_target.h>  // before highway.h
#include <hwy/highway.h>

#include "index/tile/internal/step_cuts.h"
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace filiform::internal::steps::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using Tag8 = hn::FixedTag<std::uint8_t, 16>;
using Tag16 = hn::FixedTag<std::uint16_t, 8>;
using Tag32 = hn::FixedTag<std::uint32_t, 4>;
using Vec16 = hn::Vec<Tag16>;
using Vec32 = hn::Vec<Tag32>;

HWY_INLINE Vec32 fourSteps(const std::uint8_t* at, const Cut& cut, std::size_t half, Vec32 mask) {
  const auto bytes = hn::TableLookupBytes(hn::LoadU(Tag8(), at), hn::Load(Tag8(), cut.bytes[half]));
  const Vec32 values = hn::And(hn::Shr(hn::BitCast(Tag32(), bytes), hn::Load(Tag32(), cut.shifts[half])), mask);
  const Vec32 sign = hn::Sub(hn::Zero(Tag32()), hn::And(values, hn::Set(Tag32(), 1)));
  return hn::Xor(hn::ShiftRight<1>(values), sign);
}

// Eight running sums, on top of the last of `before`.
HWY_INLINE Vec16 eightSums(const std::uint8_t* at, unsigned width, Vec16 before) {
  const Cut& cut = kCuts.of[width];
  const Vec32 mask = hn::Set(Tag32(), (1u << width) - 1);
  const Vec32 low = fourSteps(at, cut, 0, mask), high = fourSteps(at + width / 2, cut, 1, mask);
  Vec16 sums = hn::ConcatEven(Tag16(), hn::BitCast(Tag16(), high), hn::BitCast(Tag16(), low));
  sums = hn::Add(sums, hn::ShiftLeftLanes<1>(Tag16(), sums));
  sums = hn::Add(sums, hn::ShiftLeftLanes<2>(Tag16(), sums));
  sums = hn::Add(sums, hn::ShiftLeftLanes<4>(Tag16(), sums));
  return hn::Add(sums, hn::Broadcast<7>(before));
}

Progress sumGroups(const std::uint8_t* at, std::size_t readable, std::size_t groups, std::uint16_t* sums) {
  const std::uint8_t* const end = at + readable;
  Vec16 x = hn::Set(Tag16(), sums[0]), y = hn::Set(Tag16(), sums[1]), z = hn::Set(Tag16(), sums[2]);
  std::size_t done = 0;
  for (; done < groups && static_cast<std::size_t>(end - at) >= kReadable; ++done) {
    const unsigned head = at[0] | unsigned{at[1]} << 8;
    const Widths widths(head);
    if ((head & kWideSteps) != 0 || !widths.narrow()) break;
    at += 2;
    x = eightSums(at, widths.x, x);
    at += widths.x;
    y = eightSums(at, widths.y, y);
    at += widths.y;
    z = eightSums(at, widths.z, z);
    at += widths.z;
    hn::StoreInterleaved4(x, y, z, hn::Zero(Tag16()), Tag16(), sums + 4 + 4 * kStepGroup * done);
  }
  return {at, done};
}

}  // namespace

// Not in the unnamed namespace: the table below names it.
SumGroups kernel() { return sumGroups; }

}  // namespace filiform::internal::steps::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace filiform::internal {
namespace {

const std::vector<steps::SumGroups>& stepKernels() {
  static const std::vector<steps::SumGroups> kAll = [] {
    std::vector<steps::SumGroups> all;
    const std::int64_t here = HWY_SUPPORTED_TARGETS;
#if HWY_TARGETS & HWY_EMU128
    all.push_back(steps::N_EMU128::kernel());  // every processor runs it
#endif
#if HWY_TARGETS & HWY_SSSE3
    if ((here & HWY_SSSE3) != 0) all.push_back(steps::N_SSSE3::kernel());
#endif
#if HWY_TARGETS & HWY_SSE4
    if ((here & HWY_SSE4) != 0) all.push_back(steps::N_SSE4::kernel());
#endif
#if HWY_TARGETS & HWY_AVX2
    if ((here & HWY_AVX2) != 0) all.push_back(steps::N_AVX2::kernel());
#endif
#if HWY_TARGETS & HWY_AVX3
    if ((here & HWY_AVX3) != 0) all.push_back(steps::N_AVX3::kernel());
#endif
#if HWY_TARGETS & HWY_NEON
    if ((here & HWY_NEON) != 0) all.push_back(steps::N_NEON::kernel());
#endif
    return all;
  }();
  return kAll;
}

// A group near the end of the bytes, or with fewer than eight steps: copies it to where there is room to read.
void sumLastGroup(ByteReader& in, std::size_t steps, steps::SumGroups kernel, std::uint16_t* sums) {
  const unsigned head = in.u16();
  const steps::Widths widths(head);
  in.require((head & kWideSteps) == 0 && widths.narrow(), "a step is too wide");
  std::array<std::uint8_t, 2 * steps::kReadable> group{static_cast<std::uint8_t>(head),
                                                       static_cast<std::uint8_t>(head >> 8)};
  std::size_t at = 2;
  for (const unsigned width : {widths.x, widths.y, widths.z}) {
    const ByteSpan values = in.take(packedBytes(steps, static_cast<int>(width)));
    std::copy(values.begin(), values.end(), group.begin() + static_cast<std::ptrdiff_t>(at));
    at += width;
  }
  kernel(group.data(), group.size(), 1, sums);
}

}  // namespace

std::size_t stepSumSets() { return stepKernels().size(); }

void sumSteps(ByteReader& in, std::size_t steps, std::uint16_t* sums, std::size_t set) {
  const steps::SumGroups kernel = stepKernels()[std::min(set, stepSumSets() - 1)];
  std::fill_n(sums, 4, std::uint16_t{0});
  ByteReader ahead = in;
  const ByteSpan bytes = ahead.take(ahead.left());
  const steps::Progress done = kernel(bytes.data(), bytes.size(), steps / kStepGroup, sums);
  in.take(static_cast<std::uint64_t>(done.at - bytes.data()));
  for (std::size_t at = done.groups * kStepGroup; at < steps; at += kStepGroup)
    sumLastGroup(in, std::min(kStepGroup, steps - at), kernel, sums + 4 * at);
}

}  // namespace filiform::internal
#endif
