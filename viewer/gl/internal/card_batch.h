// A batch of segments on the graphics card. Thread rule: the thread of the context.
#pragma once

#include "viewer/gl/render_options.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <epoxy/gl.h>
#include <vector>

namespace filiform::internal {

class CardBatch {
 public:
  // The vertex arrays, where drawing cannot begin at any instance: each begins at the first segment of some pieces. A
  // frame drawn at once leaves them as they are.
  enum class From : std::uint8_t { large_balls, balls, cones, ribbons, lines };

  CardBatch() = default;
  CardBatch(const CardBatch&) = delete;
  CardBatch& operator=(const CardBatch&) = delete;
  ~CardBatch();

  // Replaces the content, and shows it. In debug builds, throws GraphicsError if the driver refuses it. O(segments) if
  // they are sorted for drawing.
  void put(const NeuriteBatch& batch, Layer layer);
  // Binds the batch so that drawing begins with segment `first`.
  void bindFrom(From from, std::size_t first);

  // Segments that lie together, sorted for drawing (neurite_batches.h): balls first.
  struct Block {
    std::size_t begin, balls_end, end, first_ball;
    Vector3d lo_W, hi_W;

    bool isSeen(const LevelView& view) const;
    // From an eye to the block's box; 0 inside.
    double distance_um(const Vector3d& eye_W) const {
      return (lo_W - eye_W).cwiseMax(eye_W - hi_W).cwiseMax(0.0).norm();
    }
  };
  const std::vector<Block>& blocks() const { return blocks_; }
  std::size_t size() const { return radii_um_.size(); }
  std::uint64_t bytes() const { return size() * sizeof(DrawnSegment); }
  // The end of a block's balls, or of its other segments, with at least this radius. O(log segments).
  std::size_t ballsAtLeastAsThickAs(const Block& block, double radius_um) const;
  std::size_t atLeastAsThickAs(const Block& block, double radius_um) const;
  // A ball of a block, from the origin.
  const Eigen::Vector3f& ball_um(const Block& block, std::size_t i) const {
    return balls_um_[block.first_ball + i - block.begin];
  }
  double radius_um(std::size_t i) const { return radii_um_[i]; }
  double length_um(std::size_t i) const { return lengths_um_[i]; }
  const Vector3d& origin_W() const { return origin_W_; }
  double pixel_um() const { return pixel_um_; }
  Layer layer() const { return layer_; }
  void setLayer(Layer layer) { layer_ = layer; }
  bool by_cell() const { return by_cell_; }
  TileId tile() const { return tile_; }

  bool shown = true;

 private:
  struct Vertices {
    GLuint array = 0;  // 0: not made yet
    std::size_t first = 0;
  };
  std::size_t endOfAtLeastAsThickAs(double radius_um, std::size_t begin, std::size_t end) const;

  Vector3d origin_W_;
  double pixel_um_ = 0;
  Layer layer_ = Layer::neurites;
  bool by_cell_ = false;
  TileId tile_ = 0;
  std::vector<float> radii_um_, lengths_um_;  // of the segments
  std::vector<Eigen::Vector3f> balls_um_;
  std::vector<Block> blocks_;
  std::array<Vertices, 5> vertices_{};  // by From
  GLuint buffer_ = 0;
};

}  // namespace filiform::internal
