// Reads and writes the bytes of a tile set, little-endian. Values are never cast from memory. Only this file knows the
// byte order.
#pragma once

#include "index/geometry/grid.h"
#include "index/geometry/morton.h"

#include <bit>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace filiform::internal {

using ByteSpan = std::span<const std::uint8_t>;
using Bytes = std::vector<std::uint8_t>;

std::string hex16(std::uint64_t value);  // 16 digits

inline std::uint64_t zigzag(std::int64_t v) {
  return (static_cast<std::uint64_t>(v) << 1) ^ static_cast<std::uint64_t>(v >> 63);
}
inline std::int64_t unzigzag(std::uint64_t v) { return static_cast<std::int64_t>((v >> 1) ^ (~(v & 1) + 1)); }

inline std::uint64_t loadLittle64(const std::uint8_t* p) {
  std::uint64_t v;
  std::memcpy(&v, p, sizeof v);
  if constexpr (std::endian::native == std::endian::big) v = __builtin_bswap64(v);
  return v;
}

inline void storeLittle64(std::uint8_t* p, std::uint64_t v) {
  if constexpr (std::endian::native == std::endian::big) v = __builtin_bswap64(v);
  std::memcpy(p, &v, sizeof v);
}

class ByteWriter {
 public:
  void u8(std::uint8_t v) { bytes_.push_back(v); }
  void u16(std::uint16_t v) { little(v, 2); }
  void u32(std::uint32_t v) { little(v, 4); }
  void u64(std::uint64_t v) { little(v, 8); }
  void i32(std::int32_t v) { u32(static_cast<std::uint32_t>(v)); }
  void i64(std::int64_t v) { u64(static_cast<std::uint64_t>(v)); }
  void f32(float v) { u32(std::bit_cast<std::uint32_t>(v)); }
  void f64(double v) { u64(std::bit_cast<std::uint64_t>(v)); }
  void varint(std::uint64_t v);  // 7 bits a byte, lowest first
  void text(std::string_view s) { bytes_.insert(bytes_.end(), s.begin(), s.end()); }
  void sizedText(std::string_view s) { varint(s.size()), text(s); }
  void point(const GridPoint& p) { i64(p.x()), i64(p.y()), i64(p.z()); }
  void box(const GridBox& b) { point(b.lo), point(b.hi); }
  void key(MortonKey k) { u64(static_cast<std::uint64_t>(k)), u64(static_cast<std::uint64_t>(k >> 64)); }
  void append(ByteSpan b) { bytes_.insert(bytes_.end(), b.begin(), b.end()); }
  void setU64(std::size_t at, std::uint64_t v);
  // Appends `n` zeros and returns their place. Until trim(), 8 more bytes may be written.
  std::uint8_t* room(std::size_t n) {
    const std::size_t at = bytes_.size();
    bytes_.resize(at + n + kSlack);
    return bytes_.data() + at;
  }
  void trim() { bytes_.resize(bytes_.size() - kSlack); }

  std::size_t size() const { return bytes_.size(); }
  const Bytes& bytes() const { return bytes_; }
  Bytes take() { return std::move(bytes_); }

 private:
  void little(std::uint64_t v, int n) {
    for (int i = 0; i < n; ++i) bytes_.push_back(static_cast<std::uint8_t>(v >> (8 * i)));
  }
  static constexpr std::size_t kSlack = 8;
  Bytes bytes_;
};

// What a reader throws for invalid bytes. The caller that knows the file turns it into CorruptSet or CorruptTile.
struct Damage {
  std::uint64_t offset;  // in the bytes read
  std::string what;
};

// Reads bytes in order. Throws Damage instead of reading past the end.
class ByteReader {
 public:
  explicit ByteReader(ByteSpan bytes) : bytes_(bytes) {}
  std::uint8_t u8() {
    if (at_ == bytes_.size()) fail("the bytes end too early");
    return bytes_[at_++];
  }
  std::uint16_t u16() { return static_cast<std::uint16_t>(little(2)); }
  std::uint32_t u32() { return static_cast<std::uint32_t>(little(4)); }
  std::uint64_t u64() { return little(8); }
  std::int32_t i32() { return static_cast<std::int32_t>(u32()); }
  std::int64_t i64() { return static_cast<std::int64_t>(u64()); }
  float f32() { return std::bit_cast<float>(u32()); }
  double f64() { return std::bit_cast<double>(u64()); }
  std::uint64_t varint() { return at_ < bytes_.size() && bytes_[at_] < 128 ? bytes_[at_++] : longVarint(); }
  std::uint32_t varint32();  // throws Damage if it does not fit
  GridPoint point();
  GridBox box();
  MortonKey key();
  ByteSpan take(std::uint64_t n);
  std::string sizedText() {
    const ByteSpan text = take(varint());
    return {text.begin(), text.end()};
  }

  std::uint64_t offset() const { return at_; }
  std::uint64_t left() const { return bytes_.size() - at_; }
  [[noreturn]] void fail(const std::string& what) const { throw Damage{at_, what}; }
  void require(bool good, const char* what) const {
    if (!good) fail(what);
  }

 private:
  std::uint64_t longVarint();
  std::uint64_t little(std::size_t n) {
    if (left() < n) fail("the bytes end too early");
    std::uint64_t v = 0;
    for (std::size_t i = 0; i < n; ++i) v |= std::uint64_t{bytes_[at_ + i]} << (8 * i);
    at_ += n;
    return v;
  }
  ByteSpan bytes_;
  std::uint64_t at_ = 0;
};

// Arrays of values with a fixed number of bits each, lowest bit first, padded with zeros to a byte. `bits`: 0 to
// kMaxPackedBits.
inline constexpr int kMaxPackedBits = 56;
inline int bitsFor(std::uint64_t v) { return static_cast<int>(std::bit_width(v)); }  // bits that `v` needs; 0 for 0
void packBits(ByteWriter& out, std::span<const std::uint64_t> values, int bits);
// Writes them to `at`, and returns where they end. 8 more bytes may be written.
std::uint8_t* packBits(std::uint8_t* at, std::span<const std::uint64_t> values, int bits);
inline std::uint64_t packedBytes(std::uint64_t count, int bits) {
  return (count * static_cast<std::uint64_t>(bits) + 7) / 8;
}
// Throws Damage if the bytes end too early.
void unpackBits(ByteReader& in, std::span<std::uint64_t> values, int bits);

}  // namespace filiform::internal
