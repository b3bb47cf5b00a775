#include "viewer/window/travel/internal/tooltip.h"

#include "viewer/window/travel/internal/travel.h"

#include <utility>

namespace filiform::internal {

namespace {

constexpr double kRest_s = 0.25;

}  // namespace

void Tooltip::pointerMoved(double now_s) {
  rested_since_s_ = now_s;
  text_.clear();
}

bool Tooltip::isDue(double now_s) const {
  return !asked_ && text_.empty() && now_s - rested_since_s_ >= kRest_s && rested_since_s_ != asked_for_s_;
}

void Tooltip::lookUp(Travel& travel, const RayQuery& ray) {
  asked_for_s_ = rested_since_s_;
  asked_ = true;
  travel.describeAlong(ray, [this, asked_for_s = asked_for_s_](std::string text) {
    asked_ = false;
    if (rested_since_s_ == asked_for_s) text_ = std::move(text);  // else the pointer has moved since
  });
}

}  // namespace filiform::internal
