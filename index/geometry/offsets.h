// Arrays of three non-negative coordinates a node, in as few bytes as they need. One cache line usually holds a whole
// node; several consecutive nodes are read at once. Thread rule: values that do not own their memory.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace filiform {

using Coordinates = std::array<std::uint64_t, 3>;

// One integer a coordinate.
template <typename T>
struct PlainOffsets {
  T* at;

  Coordinates get(std::size_t i) const { return {at[3 * i], at[3 * i + 1], at[3 * i + 2]}; }
  void put(std::size_t i, const Coordinates& c) const {
    for (std::size_t axis = 0; axis < 3; ++axis) at[3 * i + axis] = static_cast<std::remove_const_t<T>>(c[axis]);
  }
};

// One 64-bit word a node: 21 bits a coordinate (4 mm at the default quantum), x lowest.
template <typename T>
struct WordOffsets {
  static constexpr int kBits = 21;
  static constexpr std::uint64_t kMask = (std::uint64_t{1} << kBits) - 1;
  T* at;

  Coordinates get(std::size_t i) const {
    const std::uint64_t word = at[i];
    return {word & kMask, word >> kBits & kMask, word >> 2 * kBits};
  }
  void put(std::size_t i, const Coordinates& c) const {  // masks larger coordinates; detected later
    at[i] = (c[0] & kMask) | (c[1] & kMask) << kBits | (c[2] & kMask) << 2 * kBits;
  }
};

}  // namespace filiform
