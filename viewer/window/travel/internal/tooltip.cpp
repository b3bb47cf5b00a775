#include "viewer/window/travel/internal/tooltip.h"

#include "viewer/window/travel/internal/travel.h"

#include <optional>

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
  travel.lookAlong(ray, false, [this, asked_for_s = asked_for_s_](const std::optional<SeenNeurite>& seen) {
    asked_ = false;
    if (!seen || rested_since_s_ != asked_for_s) return;  // none, or the pointer has moved since
    text_ = nameText(*seen) + (seen->kind.empty() ? "" : "\n" + seen->kind) + "\n" + placeText(*seen);
  });
}

}  // namespace filiform::internal
