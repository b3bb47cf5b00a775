// Radii: what a tile stores of a radius, and which radii need more. Tiles store radii as 32-bit floats. An *odd* radius
// is one that the text of this float does not give back, such as 0.123456789. Sets keep odd radii in the details of
// cells. Thread rule: functions without state.
#pragma once

#include <cstdint>
#include <string_view>

namespace filiform {

struct OddRadius {
  std::uint32_t rank;  // of the sample
  double radius_um;

  bool operator==(const OddRadius&) const = default;
};

// The float that a tile stores. A radius above 0 stays above 0; one that no float can hold becomes infinite.
float storedRadius(double radius_um);

// True if the fewest digits that name storedRadius(radius_um) name another double. Doubles that differ by at most 8
// units in the last place count as equal, since a change of unit rounds. False unless the radius is finite and above 0.
// O(1); about 0.1 us.
bool isOddRadius(double radius_um);

// False if the token has so few digits that its radius cannot be odd. Requires the text of a number. O(length).
bool mayBeOdd(std::string_view token);

}  // namespace filiform
