#include "viewer/gl/internal/picture_reader.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace filiform::internal {

namespace {

// Reads rows of the bound framebuffer, the lowest first: to memory, or into the bound buffer of the card. Four bytes a
// pixel: every OpenGL can do that.
void readRows(int width, int lowest, int rows, std::uint8_t* to) {
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, lowest, width, rows, GL_RGBA, GL_UNSIGNED_BYTE, to);
}

std::size_t bytesOfRows(int width, int rows) { return std::size_t{4} * static_cast<unsigned>(width * rows); }

// Appends such rows to a picture, whose rows begin at the top.
void appendRows(Picture& picture, const std::vector<std::uint8_t>& rows) {
  const std::size_t row = bytesOfRows(picture.width, 1);
  for (std::size_t end = rows.size(); end > 0; end -= row)
    for (std::size_t at = end - row; at < end; at += 4) picture.rgb.insert(picture.rgb.end(), &rows[at], &rows[at] + 3);
}

}  // namespace

PictureReader::~PictureReader() { glDeleteBuffers(1, &rows_read_); }

bool PictureReader::readMore(const Target& target, Picture& picture, int most_rows) {
  const PictureSize& size = target.size();
  const std::size_t row = static_cast<std::size_t>(size.width) * 3;
  if (size.width == 0) return true;
  if (picture.rgb.empty() && picture.width == 0) {
    picture = {size.width, size.height, {}};
    picture.rgb.reserve(row * static_cast<std::size_t>(size.height));
    rows_under_way_ = 0;
  }
  std::vector<std::uint8_t> rows(bytesOfRows(size.width, rows_under_way_));
  if (rows_read_ == 0) glGenBuffers(1, &rows_read_);
  glBindBuffer(GL_PIXEL_PACK_BUFFER, rows_read_);
  if (!rows.empty()) glGetBufferSubData(GL_PIXEL_PACK_BUFFER, 0, static_cast<GLsizeiptr>(rows.size()), rows.data());
  appendRows(picture, rows);
  const int left = size.height - static_cast<int>(picture.rgb.size() / row);
  rows_under_way_ = std::min(most_rows, left);
  if (left > 0) {
    const auto bytes = static_cast<GLsizeiptr>(bytesOfRows(size.width, rows_under_way_));
    glBufferData(GL_PIXEL_PACK_BUFFER, bytes, nullptr, GL_STREAM_READ);
    target.bind();
    readRows(size.width, left - rows_under_way_, rows_under_way_, nullptr);
  }
  glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
  return left == 0;
}

Picture PictureReader::readWindow(const PictureSize& window) {
  Picture picture{window.width, window.height, {}};
  std::vector<std::uint8_t> rows(bytesOfRows(window.width, window.height));
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
  readRows(window.width, 0, window.height, rows.data());
  appendRows(picture, rows);
  return picture;
}

}  // namespace filiform::internal
