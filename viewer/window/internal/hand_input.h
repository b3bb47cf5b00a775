// What mouse and held keys ask of the hand: the pointer, the drag under way, the keys that push. Thread rule: one
// owner.
#pragma once

#include "solver/travel/session/session.h"
#include "viewer/scene/camera.h"
#include "viewer/window/window.h"

#include <optional>
#include <set>

namespace filiform::internal {

class HandInput {
 public:
  struct Step {
    double dx_px, dy_px;
  };

  // Takes the pointer's position of an event; a scroll event has none.
  void point(const InputEvent& event);
  double x() const { return x_; }
  double y() const { return y_; }

  // A mouse button goes down. True: the second click of a double click, within `slack_px` of the first.
  bool press(const InputEvent& event, double slack_px);
  // The drag that the button begins: pull, pull_depth, rotate, pan, or none.
  void drag(Action what) { drag_ = what; }
  Action dragged() const { return drag_; }
  bool isDragging() const { return drag_ != Action::none; }
  // The pointer's way since the last step. Of a pull_depth drag it moves the hand nearer or farther.
  Step step(const PictureSize& size);

  void hold(Action push) { held_.insert(push); }
  // Releases all actions of the key, whatever its modifiers: they may have been released before it.
  void release(const Key& key);

  // Where the hand is wanted: at the dragged pointer, else pushed by the held keys. nullopt: neither.
  std::optional<Pointing> pointing(const EyeView& view, const PictureSize& size, const Workspace& workspace,
                                   const Vector3d& p_W) const;

 private:
  std::set<Action> held_;
  Action drag_ = Action::none;
  double x_ = 0, y_ = 0, last_x_ = 0, last_y_ = 0;  // pixels
  double pressed_x_ = 0, pressed_y_ = 0, pressed_s_ = -1;
  double closer_m_ = 0;  // of the hand, by the drag under way
};

}  // namespace filiform::internal
