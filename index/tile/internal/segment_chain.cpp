#include "index/tile/internal/segment_chain.h"

#include <algorithm>
#include <array>

namespace filiform::internal {
namespace {

constexpr std::size_t kMostRecordBytes = 96;  // of a record: 2 + 4 varints of 5 + 6 coordinates of 8 + 4 + 2, and slack

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

constexpr std::array<std::uint64_t, 9> kMasks = {  // of so many bytes
    0, 0xFF, 0xFFFF, 0xFFFFFF, 0xFFFFFFFF, 0xFFFFFFFFFF, 0xFFFFFFFFFFFF, 0xFFFFFFFFFFFFFF, UINT64_MAX};

// Bytes beyond a value's width are overwritten later. Returns the width.
unsigned step(std::uint8_t*& out, const GridPoint& to, const GridPoint& from) {
  const std::uint64_t x = zigzag(to[0] - from[0]), y = zigzag(to[1] - from[1]), z = zigzag(to[2] - from[2]);
  const auto width = static_cast<unsigned>(std::bit_width(x | y | z) + 7) / 8;
  storeLittle64(out, x);
  storeLittle64(out + width, y);
  storeLittle64(out + 2 * width, z);
  out += 3 * width;
  return width;
}

[[gnu::always_inline]] inline void step(const std::uint8_t*& in, unsigned width, const GridPoint& from, GridPoint& to) {
  const std::uint64_t mask = kMasks[width];
  const std::int64_t x = unzigzag(loadLittle64(in) & mask), y = unzigzag(loadLittle64(in + width) & mask),
                     z = unzigzag(loadLittle64(in + 2 * width) & mask);
  to[0] = from[0] + x;
  to[1] = from[1] + y;
  to[2] = from[2] + z;
  in += 3 * width;
}

}  // namespace

void SegmentChain::add(const SegmentRecord& r) {
  const std::size_t block = chain_.blocks_begun();
  std::uint8_t* const begin = chain_.reserve(kMostRecordBytes);
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
    widths = step(out, r.child, last_.child) << 4;
  } else {
    if ((flags & kSameCell) != 0 && r.parent_sample == last_.child_sample && r.parent == last_.child) {
      flags |= kFollows;
    } else {
      varint(out, zigzag32(r.child_sample - r.parent_sample));
      widths = step(out, r.parent, last_.child) << 4;
    }
    widths |= step(out, r.child, r.parent);
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
    step(in, widths >> 4, last, r.child);
    r.parent = r.child;
  } else {
    if ((flags & kFollows) != 0) {
      r.parent_sample = last_sample;
      r.parent = last;
    } else {
      r.parent_sample = r.child_sample - unzigzag32(varint(in));
      step(in, widths >> 4, last, r.parent);
    }
    step(in, widths & 15, r.parent, r.child);
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
