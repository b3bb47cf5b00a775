// A picture of the scene that takes longer than a frame. It is loaded, drawn and read back in parts, between the frames
// of the window. It shows the scene as it was when the object was made.
//
// Thread rule: the thread of the graphics context.
#pragma once

#include "solver/workspace/workspace.h"
#include "viewer/gl/scene_view.h"

#include <memory>
#include <optional>

namespace filiform::internal {

class LargePicture {
 public:
  // Store, levels (may be nullptr) and context must outlive it. Copies what the frame points to. Throws GraphicsError.
  LargePicture(const TileStore& store, const Levels* levels, GraphicsContext& context, const SceneFrame& frame);

  // Works for about `most_ms`. Throws as SceneView::drawWhole().
  void advance(double most_ms);
  double done() const { return done_; }  // part that is done, 0 to 1
  bool isDone() const { return done_ >= 1; }
  Picture take() { return std::move(picture_); }  // requires isDone()
  PictureSize size() const { return frame_.size; }

  // See SceneView::end().
  std::shared_ptr<void> end() { return view_.end(); }

 private:
  SceneFrame frame_;
  std::optional<Workspace> workspace_;
  std::optional<Junction> junction_;
  Renderer renderer_;
  SceneView view_;
  bool drawn_ = false;
  Picture picture_;
  double done_ = 0;
};

}  // namespace filiform::internal
