// A picture of the scene that takes longer than a frame: loaded, drawn and read a bounded amount at a time, while the
// window goes on with frames of its own. It shows the scene as it was when the picture was asked for.
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
  // Store, levels (none: nullptr) and context must outlive it. Copies what the frame points to. Throws GraphicsError.
  LargePicture(const TileStore& store, const Levels* levels, GraphicsContext& context, const SceneFrame& frame);

  // Works for about `most_ms`. Throws as SceneView::drawWhole().
  void advance(double most_ms);
  double done() const { return done_; }  // 0 to 1; 1: take() has the picture
  bool isDone() const { return done_ >= 1; }
  Picture take() { return std::move(picture_); }
  PictureSize size() const { return frame_.size; }

  // As SceneView::end().
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
