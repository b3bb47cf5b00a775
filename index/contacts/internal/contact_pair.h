// ContactPair: two segments within the distance. Thread rule: a value.
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <tuple>

namespace filiform::internal {

// Arrays: of `from`, of `to`.
struct ContactPair {
  std::array<std::uint32_t, 2> cell, segment, child, parent;
  double distance_um;
  std::array<double, 2> t, length_um;
  std::array<std::uint16_t, 2> type;
  std::uint32_t has_unknown_radius;

  auto key() const { return std::tie(cell, segment); }  // different for each pair
};

}  // namespace filiform::internal
