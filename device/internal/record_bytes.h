// Converts values to the little-endian bytes of a recording, and back.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>

#include <xxhash.h>

namespace filiform::internal {

static_assert(std::endian::native == std::endian::little,
              "recordings are little-endian: add a byte swap for this machine");

template <typename T>
void append(std::string& out, T value) {
  static_assert(std::is_trivially_copyable_v<T>);
  char bytes[sizeof value];
  std::memcpy(bytes, &value, sizeof value);
  out.append(bytes, sizeof value);
}

// Decodes values in order. Past the end it returns zeros, and whole() becomes false.
class RecordReader {
 public:
  explicit RecordReader(std::string_view bytes) : bytes_(bytes) {}

  template <typename T>
  T get() {
    T value{};
    const std::string_view taken = take(sizeof value);
    if (taken.size() == sizeof value) std::memcpy(&value, taken.data(), sizeof value);
    return value;
  }
  // The next `size` bytes; empty if fewer are left.
  std::string_view take(std::size_t size) {
    whole_ = whole_ && bytes_.size() - at_ >= size;
    const std::string_view taken = whole_ ? bytes_.substr(at_, size) : std::string_view();
    at_ = whole_ ? at_ + size : bytes_.size();
    return taken;
  }
  bool whole() const { return whole_; }
  bool atEnd() const { return at_ == bytes_.size(); }

 private:
  std::string_view bytes_;
  std::size_t at_ = 0;
  bool whole_ = true;
};

// Checksum of a record. The seed is the record's position, so that records cannot be swapped unnoticed.
inline std::uint64_t checksum(std::string_view bytes, std::uint64_t seed) {
  return XXH3_64bits_withSeed(bytes.data(), bytes.size(), seed);
}

}  // namespace filiform::internal
