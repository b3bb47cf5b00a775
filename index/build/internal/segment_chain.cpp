#include "index/build/internal/segment_chain.h"

#include <algorithm>
#include <array>

namespace filiform::internal {
namespace {

constexpr std::size_t kMostBytes = 96;  // of a record: 2 + 4 varints of 5 + 6 coordinates of 8 + 4 + 2, and slack

enum Flag : std::uint8_t {
  kSameCell = 1,
  kNextSegment = 2,  // the segment after the one before
  kChildIsRank = 4,  // the child's rank is the segment's
  kFollows = 8,      // the parent is the child before, at the same position
  kIsolated = 16,
  kSameRadius = 32,
  kSameType = 64,
};

void varint(std::uint8_t*& out, std::uint32_t v) {
  for (; v >= 128; v >>= 7) *out++ = static_cast<std::uint8_t>(v | 128);
  *out++ = static_cast<std::uint8_t>(v);
}

std::uint32_t varint(const std::uint8_t*& in) {
  std::uint32_t v = *in & 127u;
  for (int shift = 7; *in++ >= 128; shift += 7) v |= static_cast<std::uint32_t>(*in & 127u) << shift;
  return v;
}

std::uint32_t zigzag32(std::uint32_t difference) { return difference << 1 ^ (0 - (difference >> 31)); }
std::uint32_t unzigzag32(std::uint32_t v) { return v >> 1 ^ (0 - (v & 1)); }

int step(std::uint8_t*& out, const GridPoint& d) {
  std::array<std::uint64_t, 3> v{};
  for (std::size_t i = 0; i < 3; ++i) v[i] = zigzag(d[static_cast<Eigen::Index>(i)]);
  const int width = (bitsFor(v[0] | v[1] | v[2]) + 7) / 8;
  for (const std::uint64_t value : v) {
    storeLittle64(out, value);  // bytes beyond the width are overwritten later
    out += width;
  }
  return width;
}

GridPoint step(const std::uint8_t*& in, int width) {
  const std::uint64_t mask = width == 8 ? UINT64_MAX : (std::uint64_t{1} << (8 * width)) - 1;
  GridPoint d;
  for (int i = 0; i < 3; ++i) {
    d[i] = unzigzag(loadLittle64(in) & mask);
    in += width;
  }
  return d;
}

}  // namespace

void SegmentChain::add(const SegmentRecord& r) {
  const std::size_t block = chain_.blocks_begun();
  std::uint8_t* const begin = chain_.reserve(kMostBytes);
  if (chain_.blocks_begun() != block) last_ = first();
  std::uint8_t* out = begin + 2;
  unsigned flags = 0, widths = 0;
  if (r.id.cell == last_.id.cell) {
    flags |= kSameCell;
  } else {
    varint(out, r.id.cell);
  }
  if (r.id.segment == last_.id.segment + 1) {
    flags |= kNextSegment;
  } else {
    varint(out, r.id.segment);
  }
  if (r.child_sample == r.id.segment) {
    flags |= kChildIsRank;
  } else {
    varint(out, r.child_sample);
  }
  if (r.parent_sample == r.child_sample) {
    flags |= kIsolated;
    widths = static_cast<unsigned>(step(out, r.child - last_.child)) << 4;
  } else {
    if ((flags & kSameCell) != 0 && r.parent_sample == last_.child_sample && r.parent == last_.child) {
      flags |= kFollows;
    } else {
      varint(out, zigzag32(r.child_sample - r.parent_sample));
      widths = static_cast<unsigned>(step(out, r.parent - last_.child)) << 4;
    }
    widths |= static_cast<unsigned>(step(out, r.child - r.parent));
  }
  if (std::bit_cast<std::uint32_t>(r.radius_um) == std::bit_cast<std::uint32_t>(last_.radius_um)) {
    flags |= kSameRadius;
  } else {
    std::memcpy(out, &r.radius_um, 4);
    out += 4;
  }
  if (r.type == last_.type) {
    flags |= kSameType;
  } else {
    std::memcpy(out, &r.type, 2);
    out += 2;
  }
  begin[0] = static_cast<std::uint8_t>(flags);
  begin[1] = static_cast<std::uint8_t>(widths);
  chain_.commit(static_cast<std::size_t>(out - begin));
  last_ = r;
  ++count_;
}

bool SegmentChain::Reader::next(SegmentRecord& r) {
  if (at_ == end_) {
    const ByteSpan block = blocks_.next();
    if (block.empty()) return false;
    at_ = block.data();
    end_ = at_ + block.size();
    r = first();
  }
  decode(at_, r);
  return true;
}

void SegmentChain::decode(const std::uint8_t*& at, SegmentRecord& r) {
  const std::uint8_t* in = at;
  const unsigned flags = *in++, widths = *in++;
  if ((flags & kSameCell) == 0) r.id.cell = varint(in);
  r.id.segment = (flags & kNextSegment) != 0 ? r.id.segment + 1 : varint(in);
  const GridPoint last = r.child;
  const std::uint32_t last_sample = r.child_sample;
  r.child_sample = (flags & kChildIsRank) != 0 ? r.id.segment : varint(in);
  if ((flags & kIsolated) != 0) {
    r.parent_sample = r.child_sample;
    r.parent = r.child = last + step(in, static_cast<int>(widths >> 4));
  } else {
    if ((flags & kFollows) != 0) {
      r.parent_sample = last_sample;
      r.parent = last;
    } else {
      r.parent_sample = r.child_sample - unzigzag32(varint(in));
      r.parent = last + step(in, static_cast<int>(widths >> 4));
    }
    r.child = r.parent + step(in, static_cast<int>(widths & 15));
  }
  if ((flags & kSameRadius) == 0) {
    std::memcpy(&r.radius_um, in, 4);
    in += 4;
  }
  if ((flags & kSameType) == 0) {
    std::memcpy(&r.type, in, 2);
    in += 2;
  }
  at = in;
}

}  // namespace filiform::internal
