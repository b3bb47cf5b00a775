#include "viewer/gl/frame_governor.h"

#include <algorithm>
#include <utility>

namespace filiform {

namespace {

constexpr std::uint64_t kFirstSegments = 200'000, kFirstMovingSegments = 50'000;
// A picture with all samples and shading costs some five times as much.
constexpr double kFine = 6;
// Or only twice as much where neurites are thick: the first picture in motion is not to be late.
constexpr double kLeastFine = 2;
// Of each picture in motion that was in time: the number of segments that was too large grows.
constexpr double kForgets = 1.01;
// After a picture in motion that was begun again: pixels of the next one, and its part of the segments.
constexpr int kStretchOfLate = 4, kCoarseStretch = 2;
constexpr double kPartOfLate = 0.4;
// Another job may have made a picture of fewer segments late.
constexpr double kNeverTooMany = 4.0 * FrameGovernor::kLeastSegments;

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
  budget_.moving_part_ms = kLate_ms;
}

SceneBudget FrameGovernor::budgetFor(const PictureSize& size, double scale) const {
  SceneBudget budget = budget_;
  if (scale >= 2 || std::int64_t{size.width} * size.height > kManyPixels) budget.samples = budget.moving_samples = 1;
  return budget;
}

void FrameGovernor::drew(const SceneFigures& figures) {
  if (!figures.redrawn || !(figures.picture_ms > 0)) return;
  if (figures.moving) return drewMoving(figures);
  rest_ms_ = figures.picture_ms;
  too_many_ = INFINITY;
  least_stretch_ = 1;
  shrank_ = false;
  const double coarse_ms = rest_ms_ / (budget_.moving_samples > 1 ? 1 : kLeastFine);
  const double segments = std::max(static_cast<double>(figures.segments), 1.0);
  if (const double all = segments * kMoving_ms / coarse_ms; all < static_cast<double>(budget_.moving_segments))
    budget_.moving_segments = std::max(kLeastSegments, static_cast<std::uint64_t>(all));
  // Thick cones cost their pixels, however few they are.
  budget_.moving_stretch = 1;
  double least_ms = coarse_ms * std::min(1.0, static_cast<double>(kLeastSegments) / segments);
  for (; least_ms > kLate_ms && budget_.moving_stretch < SceneBudget::kMostStretch; least_ms /= 4)
    budget_.moving_stretch *= 2;
  // Grows at rest, and shrinks in motion alone: a picture at rest is never replaced by a coarser one.
  if (!fixed_ && figures.limited && rest_ms_ < kRest_ms / 2) budget_.segments = std::min(most_, 2 * budget_.segments);
}

void FrameGovernor::drewMoving(const SceneFigures& figures) {
  const double ms = figures.picture_ms, error_px = figures.error_px;
  if (!fixed_ && rest_ms_ > kRest_ms)
    budget_.segments = std::max(kLeastSegments, times(budget_.segments, kRest_ms / rest_ms_));
  rest_ms_ = 0;
  // A finer picture costs more: it takes the time of a coarse one until its error is well below the bound.
  const double most_ms = error_px > kGood_px / 2 ? kCoarse_ms : kMoving_ms;
  if (budget_.moving_samples > 1 && (figures.samples == 1 || ms > most_ms)) {
    budget_.moving_samples = 1;
    budget_.moving_shade = false;
    return;
  }
  // A picture that was begun again had too many segments or too many pixels: the next one has fewer of both.
  const bool is_late = figures.stretch > budget_.moving_stretch;
  const bool had_larger = std::exchange(shrank_, false), is_least = budget_.moving_segments <= kLeastSegments;
  if (is_late || ms > most_ms) {
    too_many_ = std::min(too_many_, std::max(static_cast<double>(figures.segments), kNeverTooMany));
    const int larger = std::min(2 * budget_.moving_stretch, SceneBudget::kMostStretch);
    if (had_larger || is_least) least_stretch_ = budget_.moving_stretch = larger;
    if (is_late) budget_.moving_stretch = std::max(larger, kStretchOfLate);
    if (had_larger) return;
    const double factor = is_late ? kPartOfLate : std::clamp(0.8 * most_ms / ms, 0.25, 0.8);
    budget_.moving_segments =
        std::max(kLeastSegments, std::min(budget_.moving_segments, times(figures.segments, factor)));
    return;
  }
  too_many_ *= kForgets;
  const bool is_coarse = error_px > kGood_px;
  const double more = std::min({1.5 * static_cast<double>(budget_.moving_segments), 0.9 * too_many_,
                                static_cast<double>(std::min(most_, budget_.segments))});
  const bool may_grow = (figures.limited || 2 * figures.segments > budget_.moving_segments) &&
                        more > static_cast<double>(budget_.moving_segments) &&
                        ms < (is_coarse ? kCoarse_ms : kMoving_ms) / 2;
  // Smaller pixels take at most four times as long, and mostly little longer. Of a coarse picture, more segments tell
  // more than smaller pixels.
  if (figures.stretch > (is_coarse && may_grow ? kCoarseStretch : 1) &&
      (4 * ms < most_ms || (figures.stretch > least_stretch_ && 2 * ms < most_ms))) {
    budget_.moving_stretch /= 2;
    shrank_ = true;
  } else if (ms < kMoving_ms / kFine && figures.stretch == 1 && budget_.moving_samples == 1 && !is_coarse) {
    budget_.moving_samples = budget_.samples;
    budget_.moving_shade = true;
  } else if (may_grow) {
    budget_.moving_segments = static_cast<std::uint64_t>(more);
  }
}

}  // namespace filiform
