// TypeMask: which types of samples (SWC) occur in a set of segments. Thread rule: plain values.
#pragma once

#include <cstdint>

namespace filiform {

// Bit t for type t of 0 to 6, bit 7 for all others. The type of a segment is that of its child.
using TypeMask = std::uint8_t;
inline constexpr TypeMask kAnyType = 255;  // also where types are not known

constexpr TypeMask typeMaskOf(std::uint16_t type) { return static_cast<TypeMask>(type < 7 ? 1u << type : 128u); }

}  // namespace filiform
