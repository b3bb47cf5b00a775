#include "device/spacemouse/internal/spacemouse_reports.h"

#include <algorithm>
#include <cstddef>

namespace filiform::internal {

namespace {

constexpr int kFullDeflection = 350;  // the logical range in every known descriptor

double axis(std::span<const std::uint8_t> report, std::size_t at) {
  const auto raw = static_cast<std::int16_t>(report[at] | report[at + 1] << 8);
  return std::clamp<int>(raw, -kFullDeflection, kFullDeflection) / static_cast<double>(kFullDeflection);
}

}  // namespace

SpaceMouseReport takeReport(std::span<const std::uint8_t> report, SpaceMouseState& state) noexcept {
  if (report.empty()) return SpaceMouseReport::ignored;
  const std::uint8_t id = report[0];
  if ((id == 1 || id == 2) && report.size() >= 7) {
    // 13 bytes: all six axes. 7 bytes: id 1 has the first three, id 2 the others.
    const std::size_t count = id == 1 && report.size() >= 13 ? 6 : 3, first = id == 2 ? 3 : 0;
    for (std::size_t i = 0; i < count; ++i) state.axes[first + i] = axis(report, 1 + 2 * i);
    return SpaceMouseReport::motion;
  }
  if (id == 3 && report.size() >= 2) {
    state.buttons = 0;
    for (std::size_t i = 1; i < std::min<std::size_t>(report.size(), 5); ++i)
      state.buttons |= static_cast<std::uint32_t>(report[i]) << 8 * (i - 1);
    return SpaceMouseReport::buttons;
  }
  return SpaceMouseReport::ignored;
}

}  // namespace filiform::internal
