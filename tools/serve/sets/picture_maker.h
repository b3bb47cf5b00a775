// PictureMaker: pictures of sets, drawn without a display and kept for later requests.
//
// One thread draws, one picture at a time, at a low priority. The first picture makes the graphics context. Thread
// rule: internally synchronised.
#pragma once

#include "tools/pictures/camera_text.h"

#include <memory>
#include <string>

namespace filiform::tools {

class ServedSet;

class PictureMaker {
 public:
  static constexpr int kMostSide = 2048;                   // pixels
  static constexpr std::size_t kMostPictures = 4;          // in work or waiting
  static constexpr std::size_t kKeptBytes = 32 << 20;      // of finished pictures; the least recently used one goes
  static constexpr double kMostDrawing_s = 60;             // of a picture
  static constexpr std::uint64_t kMostSegments = 300'000;  // in a picture

  PictureMaker();
  ~PictureMaker();  // stops the drawing

  // The picture as PNG. `camera` is what camera_text.h reads, except follow. Waits for the picture until `most_s` is
  // over; the drawing then goes on, so that a later call finds the picture. Throws UsageError for a wrong camera,
  // Refusal: 404 for a set without a segment, 501 without OpenGL 3.3, 503 if too many pictures are waited for or the
  // time is over; also what the set throws.
  std::shared_ptr<const std::string> draw(std::shared_ptr<const ServedSet> served, const std::string& camera,
                                          PictureSize size, double most_s);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform::tools
