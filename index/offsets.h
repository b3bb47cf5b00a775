// Three coordinates a node, none negative, side by side, in as few bytes as they need: one cache line tells where a
// node is, and a few in a row are read at once.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace filiform {

using Coordinates = std::array<std::uint64_t, 3>;

// One number a coordinate.
template <typename T>
struct PlainOffsets {
  T* at;

  Coordinates get(std::size_t i) const { return {at[3 * i], at[3 * i + 1], at[3 * i + 2]}; }
  void put(std::size_t i, const Coordinates& c) const {
    for (std::size_t axis = 0; axis < 3; ++axis) at[3 * i + axis] = static_cast<std::remove_const_t<T>>(c[axis]);
  }
};

// 21 bits a coordinate, 4 mm at the default quantum, x lowest, in one word.
template <typename T>
struct WordOffsets {
  static constexpr int kBits = 21;
  static constexpr std::uint64_t kMask = (std::uint64_t{1} << kBits) - 1;
  T* at;

  Coordinates get(std::size_t i) const {
    const std::uint64_t word = at[i];
    return {word & kMask, word >> kBits & kMask, word >> 2 * kBits};
  }
  void put(std::size_t i, const Coordinates& c) const {  // masked: what does not fit is met later, by its bits
    at[i] = (c[0] & kMask) | (c[1] & kMask) << kBits | (c[2] & kMask) << 2 * kBits;
  }
};

}  // namespace filiform
