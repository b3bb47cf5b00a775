// Reads pictures back from the card. Thread rule: the thread of the context.
#pragma once

#include "viewer/gl/internal/gl_objects.h"
#include "viewer/gl/picture.h"

namespace filiform::internal {

class PictureReader {
 public:
  PictureReader() = default;
  PictureReader(const PictureReader&) = delete;
  PictureReader& operator=(const PictureReader&) = delete;
  ~PictureReader();

  // As Renderer::readMore().
  bool readMore(const Target& target, Picture& picture, int most_rows);
  // The pixels of the context's own framebuffer.
  static Picture readWindow(const PictureSize& window);

 private:
  GLuint rows_read_ = 0;    // a buffer of the card
  int rows_under_way_ = 0;  // into it
};

}  // namespace filiform::internal
