#include "viewer/gl/frame_governor.h"

#include <algorithm>

namespace filiform {

namespace {

constexpr std::uint64_t kFirstSegments = 200'000, kFirstMovingSegments = 50'000;
// A picture with all samples and shading costs some five times as much.
constexpr double kFine = 6;

std::uint64_t times(std::uint64_t count, double factor) {
  return static_cast<std::uint64_t>(static_cast<double>(count) * factor);
}

}  // namespace

FrameGovernor::FrameGovernor(std::uint64_t segments)
    : most_(segments > 0 ? segments : kMostSegments), fixed_(segments > 0) {
  budget_.segments = fixed_ ? most_ : kFirstSegments;
  budget_.moving_segments = std::min(kFirstMovingSegments, most_);
  budget_.moving_samples = 1;
  budget_.moving_shade = false;
  budget_.part_ms = kPart_ms;
}

void FrameGovernor::drew(const SceneFigures& figures) {
  if (!figures.redrawn || !(figures.picture_ms > 0)) return;
  if (figures.moving) return drewMoving(figures.picture_ms, figures.segments);
  rest_ms_ = figures.picture_ms;
  // Grows at rest, and shrinks in motion alone: a picture at rest is never replaced by a coarser one.
  if (!fixed_ && figures.limited && rest_ms_ < kRest_ms / 2) budget_.segments = std::min(most_, 2 * budget_.segments);
}

void FrameGovernor::drewMoving(double ms, std::uint64_t segments) {
  if (!fixed_ && rest_ms_ > kRest_ms)
    budget_.segments = std::max(kLeastSegments, times(budget_.segments, kRest_ms / rest_ms_));
  rest_ms_ = 0;
  if (ms > kMoving_ms) {
    if (budget_.moving_samples > 1) {
      budget_.moving_samples = 1;
      budget_.moving_shade = false;
      return;
    }
    const double factor = std::clamp(0.8 * kMoving_ms / ms, 0.25, 0.8);
    budget_.moving_segments = std::max(kLeastSegments, times(std::min(budget_.moving_segments, segments), factor));
    return;
  }
  if (ms < kMoving_ms / kFine && budget_.moving_samples == 1) {
    budget_.moving_samples = budget_.samples;
    budget_.moving_shade = true;
  } else if (ms < kMoving_ms / 2 && 2 * segments > budget_.moving_segments) {
    budget_.moving_segments = std::min({most_, budget_.segments, 3 * budget_.moving_segments / 2});
  }
}

}  // namespace filiform
