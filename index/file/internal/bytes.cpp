#include "index/file/internal/bytes.h"

#include <array>

namespace filiform::internal {

std::string hex16(std::uint64_t value) {
  std::string text(16, '0');
  for (std::size_t i = 0; i < 16; ++i) text[i] = "0123456789abcdef"[(value >> (60 - 4 * i)) & 15];
  return text;
}

void ByteWriter::varint(std::uint64_t v) {
  for (; v >= 128; v >>= 7) u8(static_cast<std::uint8_t>(v | 128));
  u8(static_cast<std::uint8_t>(v));
}

void ByteWriter::setU64(std::size_t at, std::uint64_t v) {
  for (std::size_t i = 0; i < 8; ++i) bytes_[at + i] = static_cast<std::uint8_t>(v >> (8 * i));
}

std::uint64_t ByteReader::longVarint() {
  std::uint64_t v = 0;
  for (int shift = 0; shift < 64; shift += 7) {
    const std::uint8_t byte = u8();
    if (shift == 63 && byte > 1) fail("a number is too large");
    v |= std::uint64_t{byte & 127u} << shift;
    if (byte < 128) return v;
  }
  fail("a number is too long");
}

std::uint32_t ByteReader::varint32() {
  const std::uint64_t v = varint();
  require(v <= UINT32_MAX, "a number is too large");
  return static_cast<std::uint32_t>(v);
}

GridPoint ByteReader::point() {
  GridPoint p;
  for (int i = 0; i < 3; ++i) p[i] = i64();
  return p;
}

GridBox ByteReader::box() {
  GridBox b;
  b.lo = point();
  b.hi = point();
  return b;
}

MortonKey ByteReader::key() {
  const std::uint64_t low = u64();
  return MortonKey{u64()} << 64 | low;
}

ByteSpan ByteReader::take(std::uint64_t n) {
  if (left() < n) fail("the bytes end too early");
  const ByteSpan taken = bytes_.subspan(at_, n);
  at_ += n;
  return taken;
}

std::uint8_t* packBits(std::uint8_t* at, std::span<const std::uint64_t> values, int bits) {
  std::uint64_t pending = 0;
  int held = 0;  // below 8 before each put()
  const auto put = [&](std::uint64_t v, int width) {
    pending |= v << held;
    held += width;
    storeLittle64(at, pending);  // bytes beyond those held are overwritten later
    at += held / 8;
    pending >>= held & ~7;
    held &= 7;
  };
  std::size_t i = 0;
  if (bits <= 14)  // four at once
    for (; i + 4 <= values.size(); i += 4)
      put(values[i] | values[i + 1] << bits | values[i + 2] << 2 * bits | values[i + 3] << 3 * bits, 4 * bits);
  for (; i < values.size(); ++i) put(values[i], bits);
  if (held > 0) *at++ = static_cast<std::uint8_t>(pending);
  return at;
}

void packBits(ByteWriter& out, std::span<const std::uint64_t> values, int bits) {
  packBits(out.room(packedBytes(values.size(), bits)), values, bits);
  out.trim();
}

void unpackBits(ByteReader& in, std::span<std::uint64_t> values, int bits) {
  in.require(bits <= kMaxPackedBits, "a value is too wide");
  const ByteSpan bytes = in.take(packedBytes(values.size(), bits));
  if (bits == 0) {
    for (std::uint64_t& v : values) v = 0;
    return;
  }
  const std::uint64_t mask = (std::uint64_t{1} << bits) - 1;
  const std::uint64_t readable = bytes.size() + in.left();  // later bytes may be read; a mask removes them
  std::uint64_t at = 0;                                     // in bits
  std::size_t i = 0;
  if (bits <= 14)  // four at once
    for (; i + 4 <= values.size() && at / 8 + 8 <= readable; i += 4, at += 4 * static_cast<std::uint64_t>(bits)) {
      const std::uint64_t four = loadLittle64(bytes.data() + at / 8) >> (at % 8);
      values[i] = four & mask;
      values[i + 1] = four >> bits & mask;
      values[i + 2] = four >> 2 * bits & mask;
      values[i + 3] = four >> 3 * bits & mask;
    }
  for (; i < values.size() && at / 8 + 8 <= readable; ++i, at += static_cast<std::uint64_t>(bits))
    values[i] = (loadLittle64(bytes.data() + at / 8) >> (at % 8)) & mask;
  std::array<std::uint8_t, 8> tail{};
  for (; i < values.size(); ++i, at += static_cast<std::uint64_t>(bits)) {
    const std::size_t n = bytes.size() - at / 8;
    tail.fill(0);
    std::memcpy(tail.data(), bytes.data() + at / 8, n < 8 ? n : 8);
    values[i] = (loadLittle64(tail.data()) >> (at % 8)) & mask;
  }
}

}  // namespace filiform::internal
