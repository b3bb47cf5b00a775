#include "index/contacts/internal/segment_row.h"

#include <algorithm>

// As in index/tile/internal/packed_boxes.cpp.
#define HWY_BROKEN_EMU128 0
#define HWY_BROKEN_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "index/contacts/internal/segment_row.cpp"
// clang-format off
#include <hwy/foreach_target.h>  // before highway.h
#include <hwy/highway.h>
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace filiform::internal::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using Row = SegmentRow;
using Tag = hn::CappedTag<float, Row::kFew>;
using TagCell = hn::RebindToUnsigned<Tag>;
using Vec = hn::Vec<Tag>;
constexpr std::size_t kLanes = hn::MaxLanes(Tag());

// One bit a lane of eight, for test(first lane).
template <class Test>
HWY_INLINE unsigned bitsOf(const Test& test) {
  unsigned bits = 0;
  for (std::size_t lane = 0; lane < Row::kFew; lane += kLanes) {
    std::uint8_t some[8] = {};
    hn::StoreMaskBits(Tag(), test(lane), some);
    bits |= unsigned{some[0]} << lane;
  }
  return bits;
}

// The boxes within the distance of another along each axis.
HWY_INLINE unsigned meeting(const Row::Box& box, float within_um, const Row::Boxes& boxes) {
  return bitsOf([&](std::size_t lane) HWY_ATTR {
    const auto along = [&](std::size_t axis) HWY_ATTR {
      return hn::And(hn::Ge(hn::Set(Tag(), box.hi[axis] + within_um), hn::LoadU(Tag(), &boxes.lo[axis][lane])),
                     hn::Le(hn::Set(Tag(), box.lo[axis] - within_um), hn::LoadU(Tag(), &boxes.hi[axis][lane])));
    };
    return hn::And(along(0), hn::And(along(1), along(2)));
  });
}

// The segments of a leaf whose boxes are within the distance of another box along each axis.
HWY_INLINE unsigned meeting(const Row::Leaf& leaf, const Row::Box& box, float within_um) {
  return bitsOf([&](std::size_t lane) HWY_ATTR {
    const Vec more = hn::Add(hn::Set(Tag(), within_um), hn::LoadU(Tag(), &leaf.radius[lane]));
    const auto along = [&](std::size_t axis) HWY_ATTR {
      const Vec middle = hn::LoadU(Tag(), &leaf.middle[axis][lane]);
      const Vec half = hn::Add(more, hn::Abs(hn::LoadU(Tag(), &leaf.half[axis][lane])));
      return hn::And(hn::Ge(hn::Add(middle, half), hn::Set(Tag(), box.lo[axis])),
                     hn::Le(hn::Sub(middle, half), hn::Set(Tag(), box.hi[axis])));
    };
    return hn::And(along(0), hn::And(along(1), along(2)));
  });
}

// The segments of other cells that may lie within the distance of one. Two segments with their middles w apart are at
// least (w^2 - |w.half a| - |w.half b|) / |w| apart: their distance along w.
HWY_INLINE unsigned nearOf(const Row::Leaf& a, std::size_t i, float within_um, const Row::Leaf& b) {
  return bitsOf([&](std::size_t lane) HWY_ATTR {
    // Without arrays of vectors, which g++ keeps in memory.
    const auto w = [&](std::size_t axis) HWY_ATTR {
      return hn::Sub(hn::LoadU(Tag(), &b.middle[axis][lane]), hn::Set(Tag(), a.middle[axis][i]));
    };
    const Vec x = w(0), y = w(1), z = w(2);
    const auto along = [&](Vec hx, Vec hy, Vec hz)
                           HWY_ATTR { return hn::Add(hn::Mul(x, hx), hn::Add(hn::Mul(y, hy), hn::Mul(z, hz))); };
    const auto half_a = [&](std::size_t axis) HWY_ATTR { return hn::Set(Tag(), a.half[axis][i]); };
    const auto half_b = [&](std::size_t axis) HWY_ATTR { return hn::LoadU(Tag(), &b.half[axis][lane]); };
    const Vec squared = along(x, y, z);
    const Vec halves =
        hn::Add(hn::Abs(along(half_a(0), half_a(1), half_a(2))), hn::Abs(along(half_b(0), half_b(1), half_b(2))));
    const Vec reach = hn::Add(hn::Set(Tag(), within_um + a.radius[i]), hn::LoadU(Tag(), &b.radius[lane]));
    const auto same = hn::Eq(hn::LoadU(TagCell(), &b.cell[lane]), hn::Set(TagCell(), a.cell[i]));
    return hn::Not(
        hn::Or(hn::Gt(hn::Sub(squared, halves), hn::Mul(reach, hn::Sqrt(squared))), hn::RebindMask(Tag(), same)));
  });
}

template <class Use>
HWY_INLINE void forEachBit(unsigned bits, std::size_t first, std::size_t end, const Use& use) {
  for (; bits != 0; bits &= bits - 1) {
    const std::size_t at = first + hwy::Num0BitsBelowLS1Bit_Nonzero32(bits);
    if (at < end) use(at);
  }
}

void findNearRows(const Row& a, const Row& b, float within_um,
                  const std::function<void(std::span<const NearSegments>)>& visit) {
  NearSegments found[1024];
  std::size_t count = 0;
  constexpr std::size_t kFew = Row::kFew;
  Row::Boxes all_b;
  all_b.extend(0, b.all);
  for (std::size_t a2 = 0; a2 < a.boxes[0].size(); ++a2) {
    const Row::Box box2 = a.boxes[1][a2 / kFew].at(a2 % kFew);
    if (meeting(box2, within_um, all_b) == 0) continue;
    for (std::size_t b3 = 0; b3 < b.boxes[1].size(); ++b3)
      forEachBit(meeting(box2, within_um, b.boxes[1][b3]), kFew * b3, b.boxes[0].size(), [&](std::size_t b2) HWY_ATTR {
        const Row::Box other2 = b.boxes[1][b3].at(b2 % kFew);
        forEachBit(
            meeting(other2, within_um, a.boxes[0][a2]), kFew * a2, a.leaves.size(), [&](std::size_t a1) HWY_ATTR {
              const Row::Box box1 = a.boxes[0][a2].at(a1 % kFew);
              forEachBit(
                  meeting(box1, within_um, b.boxes[0][b2]), kFew * b2, b.leaves.size(), [&](std::size_t b1) HWY_ATTR {
                    const Row::Box other1 = b.boxes[0][b2].at(b1 % kFew);
                    forEachBit(
                        meeting(a.leaves[a1], other1, within_um), kFew * a1, a.size, [&](std::size_t i) HWY_ATTR {
                          forEachBit(nearOf(a.leaves[a1], i % kFew, within_um, b.leaves[b1]), kFew * b1, b.size,
                                     [&](std::size_t j) HWY_ATTR {
                                       found[count++] = {static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j)};
                                     });
                          if (count < std::size(found) - kFew) return;
                          visit({found, count});
                          count = 0;
                        });
                  });
            });
      });
  }
  if (count > 0) visit({found, count});
}

}  // namespace
}  // namespace filiform::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace filiform::internal {

HWY_EXPORT(findNearRows);

void findNear(const SegmentRow& a, const SegmentRow& b, float within_um,
              const std::function<void(std::span<const NearSegments>)>& visit) {
  HWY_DYNAMIC_DISPATCH(findNearRows)(a, b, within_um, visit);
}

void SegmentRow::Box::extend(const Box& other) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    lo[axis] = std::min(lo[axis], other.lo[axis]);
    hi[axis] = std::max(hi[axis], other.hi[axis]);
  }
}

SegmentRow::Boxes::Boxes() {
  for (std::size_t axis = 0; axis < 3; ++axis) lo[axis].fill(HUGE_VALF), hi[axis].fill(-HUGE_VALF);
}

SegmentRow::Box SegmentRow::Boxes::at(std::size_t lane) const {
  return {{lo[0][lane], lo[1][lane], lo[2][lane]}, {hi[0][lane], hi[1][lane], hi[2][lane]}};
}

void SegmentRow::Boxes::extend(std::size_t lane, const Box& box) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    lo[axis][lane] = std::min(lo[axis][lane], box.lo[axis]);
    hi[axis][lane] = std::max(hi[axis][lane], box.hi[axis]);
  }
}

SegmentRow::Box SegmentRow::Leaf::box(std::size_t lane) const {
  Box box;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const float more = std::abs(half[axis][lane]) + radius[lane];
    box.lo[axis] = middle[axis][lane] - more, box.hi[axis] = middle[axis][lane] + more;
  }
  return box;
}

void SegmentRow::add(std::uint32_t cell, const SegmentEnds& ends) {
  const std::size_t lane = size++ % kFew;
  if (lane == 0) leaves.emplace_back();
  Leaf& to = leaves.back();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double child = ends.child_W.data()[axis], parent = ends.parent_W.data()[axis];
    to.middle[axis][lane] = static_cast<float>((parent + child) / 2);
    to.half[axis][lane] = static_cast<float>((parent - child) / 2);
  }
  to.radius[lane] = static_cast<float>(std::max(ends.child_radius_um, ends.parent_radius_um));
  to.cell[lane] = cell;
}

void SegmentRow::finish() {
  leaves.shrink_to_fit();
  const std::size_t fews = (leaves.size() + kFew - 1) / kFew;
  boxes[0].resize(fews);
  boxes[1].resize((fews + kFew - 1) / kFew);
  for (std::size_t leaf = 0; leaf < leaves.size(); ++leaf) {
    Box box;
    for (std::size_t lane = 0; lane < kFew && kFew * leaf + lane < size; ++lane) box.extend(leaves[leaf].box(lane));
    boxes[0][leaf / kFew].extend(leaf % kFew, box);
    boxes[1][leaf / kFew / kFew].extend(leaf / kFew % kFew, box);
    all.extend(box);
  }
}

std::uint64_t SegmentRow::bytes() const {
  return leaves.capacity() * sizeof(Leaf) + (boxes[0].capacity() + boxes[1].capacity()) * sizeof(Boxes);
}

}  // namespace filiform::internal
#endif
