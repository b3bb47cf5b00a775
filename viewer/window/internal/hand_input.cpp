#include "viewer/window/internal/hand_input.h"

#include "viewer/scene/pointer.h"
#include "viewer/window/settings/bindings.h"

#include <cmath>

namespace filiform::internal {

namespace {

constexpr double kDoubleClick_s = 0.4;
constexpr double kPush_m = 0.006;  // from the proxy to a hand that a held key pushes
constexpr double kDepth_m = 0.12;  // by which a drag over the height of the picture moves the hand

}  // namespace

void HandInput::point(const InputEvent& event) {
  if (event.kind == InputEvent::Kind::scroll) return;
  x_ = event.x;
  y_ = event.y;
}

bool HandInput::press(const InputEvent& event, double slack_px) {
  const bool twice = event.button == 0 && event.time_s - pressed_s_ < kDoubleClick_s &&
                     std::hypot(event.x - pressed_x_, event.y - pressed_y_) < slack_px;
  pressed_s_ = twice ? -1 : event.time_s;
  last_x_ = pressed_x_ = event.x;
  last_y_ = pressed_y_ = event.y;
  closer_m_ = 0;
  return twice;
}

HandInput::Step HandInput::step(const PictureSize& size) {
  const Step step{x_ - last_x_, y_ - last_y_};
  last_x_ = x_;
  last_y_ = y_;
  if (drag_ == Action::pull_depth) closer_m_ += step.dy_px / size.height * kDepth_m;
  return step;
}

void HandInput::release(const Key& key) {
  for (const Binding& binding : bindings())
    if (binding.first.code == key.code) held_.erase(binding.action);
}

std::optional<Pointing> HandInput::pointing(const EyeView& view, const PictureSize& size, const Workspace& workspace,
                                            const Vector3d& p_W) const {
  if (drag_ == Action::pull) return Pointing::at(pointedAt_D(view, x_, y_, size, workspace, p_W, closer_m_));
  if (drag_ == Action::pull_depth)
    return Pointing::at(pointedAt_D(view, pressed_x_, pressed_y_, size, workspace, p_W, closer_m_));
  const auto held = [&](Action a) { return held_.contains(a) ? 1.0 : 0.0; };
  const Vector3d push(held(Action::push_right) - held(Action::push_left),
                      held(Action::push_up) - held(Action::push_down),
                      held(Action::push_closer) - held(Action::push_away));
  if (push.isZero()) return std::nullopt;
  return Pointing::push(kPush_m * push.normalized());
}

}  // namespace filiform::internal
