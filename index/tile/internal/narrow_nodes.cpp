#include "index/tile/internal/narrow_nodes.h"

#include <algorithm>
#include <array>
#include <vector>

// As in packed_boxes.cpp.
#define HWY_BROKEN_EMU128 0
#define HWY_BROKEN_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "index/tile/internal/narrow_nodes.cpp"
// clang-format off
#include <hwy/foreach_target.h>  // before highway.h
#include <hwy/highway.h>

#include "index/tile/internal/narrow_tables.h"
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace filiform::internal::narrow::HWY_NAMESPACE {
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

// Bits of eight nodes a byte. Bit i: the midpoint of nodes i and i + 1 lies in the block.
void midpointBits(const std::uint16_t* offsets, std::size_t nodes, const NarrowBlock& block, std::uint8_t* inside) {
  for (std::size_t node = 0; node < nodes; node += 8, offsets += 24, ++inside) {
    unsigned all = 0xff;
    for (std::size_t part = 0; part < 3; ++part) {
      const Vec16 a = hn::LoadU(Tag16(), offsets + 8 * part), b = hn::LoadU(Tag16(), offsets + 8 * part + 3);
      const Vec16 middle = hn::Add(hn::And(a, b), hn::ShiftRight<1>(hn::Xor(a, b)));
      const Vec16 above = hn::Sub(middle, hn::LoadU(Tag16(), &block.lo[8 * part]));
      const Vec16 least = hn::Min(above, hn::LoadU(Tag16(), &block.range[8 * part]));
      std::uint8_t bits[8] = {};
      hn::StoreMaskBits(Tag16(), hn::Eq(least, above), bits);
      all &= kNodesInside.of[part][bits[0]];
    }
    *inside = static_cast<std::uint8_t>(all);
  }
}

}  // namespace

// Not in the unnamed namespace: the table below names it.
Kernels kernels() { return {sumGroups, midpointBits}; }

}  // namespace filiform::internal::narrow::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace filiform::internal {
namespace {

const std::vector<narrow::Kernels>& narrowKernels() {
  static const std::vector<narrow::Kernels> kAll = [] {
    std::vector<narrow::Kernels> all;
    const std::int64_t here = HWY_SUPPORTED_TARGETS;
#if HWY_TARGETS & HWY_EMU128
    all.push_back(narrow::N_EMU128::kernels());  // every processor runs it
#endif
#if HWY_TARGETS & HWY_SSSE3
    if ((here & HWY_SSSE3) != 0) all.push_back(narrow::N_SSSE3::kernels());
#endif
#if HWY_TARGETS & HWY_SSE4
    if ((here & HWY_SSE4) != 0) all.push_back(narrow::N_SSE4::kernels());
#endif
#if HWY_TARGETS & HWY_AVX2
    if ((here & HWY_AVX2) != 0) all.push_back(narrow::N_AVX2::kernels());
#endif
#if HWY_TARGETS & HWY_AVX3
    if ((here & HWY_AVX3) != 0) all.push_back(narrow::N_AVX3::kernels());
#endif
#if HWY_TARGETS & HWY_NEON
    if ((here & HWY_NEON) != 0) all.push_back(narrow::N_NEON::kernels());
#endif
#if HWY_TARGETS & HWY_WASM
    if ((here & HWY_WASM) != 0) all.push_back(narrow::N_WASM::kernels());
#endif
    return all;
  }();
  return kAll;
}

const narrow::Kernels& kernelsOf(std::size_t set) { return narrowKernels()[std::min(set, narrowSets() - 1)]; }

// A group near the end of the bytes, or with fewer than eight steps: copies it to where there is room to read.
void sumLastGroup(ByteReader& in, std::size_t steps, const narrow::Kernels& kernels, std::uint16_t* sums) {
  const unsigned head = in.u16();
  const narrow::Widths widths(head);
  in.require((head & kWideSteps) == 0 && widths.narrow(), "a step is too wide");
  std::array<std::uint8_t, 2 * narrow::kReadable> group{static_cast<std::uint8_t>(head),
                                                        static_cast<std::uint8_t>(head >> 8)};
  std::size_t at = 2;
  for (const unsigned width : {widths.x, widths.y, widths.z}) {
    const ByteSpan values = in.take(packedBytes(steps, static_cast<int>(width)));
    std::copy(values.begin(), values.end(), group.begin() + static_cast<std::ptrdiff_t>(at));
    at += width;
  }
  kernels.sum(group.data(), group.size(), 1, sums);
}

}  // namespace

std::size_t narrowSets() { return narrowKernels().size(); }

void sumSteps(ByteReader& in, std::size_t steps, std::uint16_t* sums, std::size_t set) {
  const narrow::Kernels& kernels = kernelsOf(set);
  std::fill_n(sums, 4, std::uint16_t{0});
  ByteReader ahead = in;
  const ByteSpan bytes = ahead.take(ahead.left());
  const narrow::Progress done = kernels.sum(bytes.data(), bytes.size(), steps / kStepGroup, sums);
  in.take(static_cast<std::uint64_t>(done.at - bytes.data()));
  for (std::size_t at = done.groups * kStepGroup; at < steps; at += kStepGroup)
    sumLastGroup(in, std::min(kStepGroup, steps - at), kernels, sums + 4 * at);
}

NarrowBlock::NarrowBlock(const GridBox& block, const GridPoint& origin) {
  for (int axis = 0; axis < 3; ++axis) {
    const std::int64_t low = std::max<std::int64_t>(block.lo[axis] - origin[axis], 0),
                       high = std::min<std::int64_t>(block.hi[axis] - origin[axis], UINT16_MAX);
    empty = empty || low > high;
    for (auto i = static_cast<std::size_t>(axis); i < lo.size(); i += 3) {
      lo[i] = static_cast<std::uint16_t>(low);
      range[i] = static_cast<std::uint16_t>(high - low);
    }
  }
}

void findMidpoints(const std::uint16_t* offsets, std::size_t nodes, const NarrowBlock& block,
                   std::vector<std::uint32_t>& inside, std::size_t set) {
  std::vector<std::uint8_t> bits(4 * ((nodes + 31) / 32), 0);
  kernelsOf(set).midpoints(offsets, nodes, block, bits.data());
  inside.resize(bits.size() / 4);
  for (std::size_t i = 0; i < inside.size(); ++i)
    inside[i] = bits[4 * i] | bits[4 * i + 1] << 8 | bits[4 * i + 2] << 16 | std::uint32_t{bits[4 * i + 3]} << 24;
}

}  // namespace filiform::internal
#endif
