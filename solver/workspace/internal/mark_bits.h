// Bits of RunMarks (device/recording/replay.h): events of an exchange that its state does not show. RunMarks::values
// are the tiles that the tick met absent. The numbers are part of recordings: never change them.
#pragma once

#include <cstdint>

namespace filiform::internal {

struct MarkBits {
  static constexpr std::uint32_t kTicked = 1;      // a tick was computed with the state
  static constexpr std::uint32_t kJumped = 2;      // before the tick, the hand jumped to the next leg
  static constexpr std::uint32_t kLegDropped = 4;  // before the tick, the next leg was given up
  static constexpr std::uint32_t kMoreAbsent = 8;  // the tick met more absent tiles than the marks hold
  static constexpr std::uint32_t kMeasured = 16;   // the tick's time step was measured; else it was the period
};

}  // namespace filiform::internal
