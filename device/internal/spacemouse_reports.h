// What 3Dconnexion mice send: HID reports, in both formats that exist, told apart by their length.
#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace filiform::internal {

struct SpaceMouseState {
  // X, Y, Z, then the turns about them, of full deflection, in -1..1; axes as the device has them: X to the right,
  // Y towards the person, Z down.
  std::array<double, 6> axes{};
  std::uint32_t buttons = 0;  // bit i: button i held
};

enum class SpaceMouseReport : std::uint8_t { ignored, motion, buttons };

// Takes one report, id first, into `state`; says what it was. Whatever is not known or too short is ignored, and leaves
// `state` alone.
SpaceMouseReport takeReport(std::span<const std::uint8_t> report, SpaceMouseState& state) noexcept;

}  // namespace filiform::internal
