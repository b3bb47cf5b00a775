#include "viewer/gl/internal/card_batch.h"

#include "viewer/gl/internal/gl_objects.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

namespace filiform::internal {

CardBatch::~CardBatch() {
  for (const Vertices& vertices : vertices_) glDeleteVertexArrays(1, &vertices.array);
  glDeleteBuffers(1, &buffer_);
}

void CardBatch::put(const NeuriteBatch& batch, Layer layer) {
  std::vector<DrawnSegment> sorted;
  std::span<const DrawnSegment> segments = batch.segments;
  if (!isSortedForDrawing(batch)) {
    NeuriteBatch copy = batch;
    sortForDrawing(copy);
    sorted = std::move(copy.segments);
    segments = sorted;
  }
  origin_W_ = batch.origin_W;
  pixel_um_ = batch.pixel_um;
  layer_ = layer;
  by_cell_ = batch.by_cell;
  tile_ = batch.tile;
  shown = true;
  radii_um_.clear();
  radii_um_.reserve(segments.size());
  lengths_um_.clear();
  lengths_um_.reserve(segments.size());
  for (const DrawnSegment& s : segments) {
    radii_um_.push_back(std::max(s.a_radius_um, s.b_radius_um));
    lengths_um_.push_back(std::hypot(s.b_um[0] - s.a_um[0], s.b_um[1] - s.a_um[1], s.b_um[2] - s.a_um[2]));
  }
  blocks_.clear();
  balls_um_.clear();
  const auto addBlock = [&](std::size_t begin, std::size_t end, const Vector3d& lo_W, const Vector3d& hi_W) {
    const auto own = segments.subspan(begin, end - begin);
    const auto balls = std::partition_point(own.begin(), own.end(), isBall) - own.begin();
    blocks_.push_back({begin, begin + static_cast<std::size_t>(balls), end, balls_um_.size(), lo_W, hi_W});
    for (auto ball = own.begin(); ball < own.begin() + balls; ++ball)
      balls_um_.emplace_back(ball->a_um[0], ball->a_um[1], ball->a_um[2]);
  };
  std::size_t begin = 0;
  for (const NeuriteBatch::Block& block : batch.blocks)
    addBlock(std::exchange(begin, block.end), block.end, block.lo_W, block.hi_W);
  if (batch.blocks.empty()) addBlock(0, segments.size(), batch.lo_W, batch.hi_W);
  if (buffer_ == 0) glGenBuffers(1, &buffer_);
  glBindBuffer(GL_ARRAY_BUFFER, buffer_);
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(segments.size_bytes()), segments.data(), GL_STATIC_DRAW);
#ifndef NDEBUG
  requireNoError("segments");  // else the next picture says so
#endif
}

// OpenGL 3.3 and WebGL lack glDrawArraysInstancedBaseInstance: the pointers then say where to begin.
void CardBatch::bindFrom(From from, std::size_t first) {
  Vertices& vertices = vertices_[static_cast<std::size_t>(from)];
  const bool is_new = vertices.array == 0;
  if (is_new) glGenVertexArrays(1, &vertices.array);
  glBindVertexArray(vertices.array);
  if (!is_new && vertices.first == first) return;
  vertices.first = first;
  glBindBuffer(GL_ARRAY_BUFFER, buffer_);
  for (GLuint place = 0; is_new && place < 3; ++place) {
    glEnableVertexAttribArray(place);
    glVertexAttribDivisor(place, 1);
  }
  const auto at = [first](std::size_t offset) {
    return reinterpret_cast<const void*>(first * sizeof(DrawnSegment) + offset);
  };
  glVertexAttribPointer(0, 4, GL_FLOAT, GL_FALSE, sizeof(DrawnSegment), at(offsetof(DrawnSegment, a_um)));
  glVertexAttribPointer(1, 4, GL_FLOAT, GL_FALSE, sizeof(DrawnSegment), at(offsetof(DrawnSegment, b_um)));
  glVertexAttribIPointer(2, 1, GL_UNSIGNED_INT, sizeof(DrawnSegment), at(offsetof(DrawnSegment, paint)));
}

bool CardBatch::Block::isSeen(const LevelView& view) const {
  return std::all_of(view.planes.begin(), view.planes.end(), [&](const LevelView::Plane& plane) {
    return plane.n.dot((plane.n.array() >= 0).select(hi_W, lo_W).matrix()) >= plane.d;
  });
}

std::size_t CardBatch::endOfAtLeastAsThickAs(double radius_um, std::size_t begin, std::size_t end) const {
  const auto first = radii_um_.begin() + static_cast<std::ptrdiff_t>(begin);
  const auto last = radii_um_.begin() + static_cast<std::ptrdiff_t>(end);
  return static_cast<std::size_t>(
      std::partition_point(first, last, [radius_um](float own_um) { return own_um >= radius_um; }) - radii_um_.begin());
}

std::size_t CardBatch::ballsAtLeastAsThickAs(const Block& block, double radius_um) const {
  return endOfAtLeastAsThickAs(radius_um, block.begin, block.balls_end);
}
std::size_t CardBatch::atLeastAsThickAs(const Block& block, double radius_um) const {
  return endOfAtLeastAsThickAs(radius_um, block.balls_end, block.end);
}

}  // namespace filiform::internal
