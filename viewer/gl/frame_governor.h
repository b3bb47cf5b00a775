// How much a frame may draw, by the measured time of the frames before.
// Thread rule: one thread.
#pragma once

#include "viewer/gl/scene_frame.h"

#include <cstdint>

namespace filiform {

class FrameGovernor {
 public:
  // A picture in motion is to take kMoving_ms, or up to kCoarse_ms while its error exceeds kGood_px; one that takes
  // kLate_ms is begun again with larger pixels. A picture at rest is drawn in parts of kPart_ms and grows while it
  // takes less than half of kRest_ms.
  static constexpr double kMoving_ms = 45, kCoarse_ms = 55, kLate_ms = 60, kGood_px = 8;
  static constexpr double kPart_ms = 30, kRest_ms = 1000;
  static constexpr std::uint64_t kMostSegments = 2'000'000, kLeastSegments = 2000;

  // `segments`: chosen at rest, and never more in motion; 0: as many as kRest_ms allows, at most kMostSegments.
  explicit FrameGovernor(std::uint64_t segments = 0);
  const SceneBudget& budget() const { return budget_; }  // of the next frame
  // The same for a picture of this size: with one sample a pixel if it has more than kManyPixels, or if `scale`, pixels
  // for a point of text, is 2 or more.
  SceneBudget budgetFor(const PictureSize& size, double scale) const;
  static constexpr std::int64_t kManyPixels = std::int64_t{1} << 24;
  // Takes the figures of a frame that was drawn with this budget.
  void drew(const SceneFigures& figures);

 private:
  void drewMoving(const SceneFigures& figures);

  std::uint64_t most_;
  bool fixed_;
  SceneBudget budget_;
  double rest_ms_ = 0;          // of the last picture at rest
  int least_stretch_ = 1;       // smaller pixels took too long
  bool shrank_ = false;         // the last change made pixels smaller
  double too_many_ = INFINITY;  // segments in motion that took too long since; grows slowly, as the view moves
};

}  // namespace filiform
