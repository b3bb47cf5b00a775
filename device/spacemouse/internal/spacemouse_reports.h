// Decodes the HID reports of 3Dconnexion mice. There are two formats; the length of a report tells which.
#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace filiform::internal {

struct SpaceMouseState {
  // X, Y, Z, then the turns about them, as a fraction of full deflection in -1..1. Axes of the device: X right, Y
  // towards the person, Z down.
  std::array<double, 6> axes{};
  std::uint32_t buttons = 0;  // bit i: button i held
};

enum class SpaceMouseReport : std::uint8_t { ignored, motion, buttons };

// Decodes one report, id first, into `state` and returns its kind. Unknown or short reports are ignored and leave
// `state` unchanged.
SpaceMouseReport takeReport(std::span<const std::uint8_t> report, SpaceMouseState& state) noexcept;

}  // namespace filiform::internal
