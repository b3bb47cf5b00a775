// Pictures of the scene and of the window in files. A picture of the scene is drawn in parts between the frames; a
// worker thread writes the files. Reports progress and failures as messages. Thread rule: the window's thread.
#pragma once

#include "solver/travel/session/worker.h"
#include "viewer/gl/internal/large_picture.h"
#include "viewer/window/settings/internal/messages.h"
#include "viewer/window/travel/internal/closing.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>

namespace filiform::internal {

class Screenshots {
 public:
  using Write = std::function<void(const Picture&, const std::string& path)>;  // runs on the worker's thread

  // Messages and closing must outlive it. Files are `folder`/filiform-TIME-NUMBER.png.
  Screenshots(std::string folder, Write write, Messages& messages, Closing& closing)
      : folder_(std::move(folder)), write_(std::move(write)), messages_(messages), closing_(closing) {}

  // Begins a picture of the frame's scene, `times` as large as the frame but at most Renderer::kMaxSize a side. Reports
  // a message if another one is being drawn. Store, levels and context must stay valid until drop() or the end.
  void begin(SceneFrame frame, int times, const TileStore& store, const Levels* levels, GraphicsContext& context);
  // Draws the picture under way for some 15 ms. Saves it when it is whole.
  void advance();
  void cancel();  // drops the picture, and says so
  void drop();    // without a word; the loading thread ends beside the frames
  // Writes a picture to a new file.
  void save(Picture picture);

  // Takes up the results of the writing thread: once a frame.
  void serve();
  // Waits until all files are written. Returns the last failure; empty: none.
  std::string finish();

  bool isDrawing() const { return large_ != nullptr; }
  // For the user: what is drawn or written now; empty: nothing.
  std::string text() const;
  double part() const { return large_ ? large_->done() : -1; }  // of the picture being drawn, 0 to 1; -1: none
  std::uint64_t written() const { return written_; }
  const std::string& lastPath() const { return last_path_; }

 private:
  std::string folder_;
  Write write_;
  Messages& messages_;
  Closing& closing_;
  std::uint64_t asked_ = 0, written_ = 0;
  std::string last_path_;
  std::unique_ptr<LargePicture> large_;  // the one being drawn
  Worker writer_;                        // destroyed first: its work uses the rest
};

}  // namespace filiform::internal
