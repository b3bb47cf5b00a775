// Renderers: a renderer without a window, and scenes of a few neurites and balls for it.
#pragma once

#include "viewer/gl/renderer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <string>

#include <gtest/gtest.h>

namespace filiform::test {

inline constexpr Rgba kRed{220, 40, 40, 1}, kGreen{40, 200, 60, 2};  // of different cells

inline NeuriteBatch neurites(std::initializer_list<std::array<double, 8>> list, Rgba colour, const Vector3d& origin_W) {
  NeuriteBatch batch;  // each: ax ay az ar bx by bz br, relative to the origin
  batch.origin_W = origin_W;
  batch.lo_W.setConstant(INFINITY);
  batch.hi_W.setConstant(-INFINITY);
  for (const auto& v : list) {
    DrawnSegment s{};
    for (std::size_t i = 0; i < 3; ++i) {
      s.a_um[i] = static_cast<float>(v[i]);
      s.b_um[i] = static_cast<float>(v[i + 4]);
    }
    s.a_radius_um = static_cast<float>(v[3]);
    s.b_radius_um = static_cast<float>(v[7]);
    s.paint = paintOf(colour);
    const double most = std::max(v[3], v[7]);
    for (const std::size_t i : {0, 4}) {
      const Vector3d p = origin_W + Vector3d(v[i], v[i + 1], v[i + 2]);
      batch.lo_W = batch.lo_W.cwiseMin(p - Vector3d::Constant(most));
      batch.hi_W = batch.hi_W.cwiseMax(p + Vector3d::Constant(most));
    }
    batch.segments.push_back(s);
  }
  return batch;
}
inline NeuriteBatch ball(double x, double y, double z, double r, Rgba colour,
                         const Vector3d& origin_W = Vector3d::Zero()) {
  return neurites({{x, y, z, r, x, y, z, r}}, colour, origin_W);
}

struct LitArea {
  double count = 0, x = 0, y = 0;  // number of pixels, and their middle
};
// Pixels in which this channel is by far the strongest.
inline LitArea litAreaOf(const Picture& picture, int channel) {
  LitArea region;
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < picture.width; ++x) {
      const std::uint8_t* p = &picture.rgb[3 * static_cast<std::size_t>(y * picture.width + x)];
      const int other = std::max(p[(channel + 1) % 3], p[(channel + 2) % 3]);
      if (p[channel] < other + 30) continue;
      region.count += 1;
      region.x += x + 0.5;
      region.y += y + 0.5;
    }
  if (region.count > 0) region.x /= region.count, region.y /= region.count;
  return region;
}

class Renderers : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    context_ = makeOffscreenContext();
    EXPECT_NE(context_->description().find("OpenGL"), std::string::npos);
  }
  static void TearDownTestSuite() { context_.reset(); }

  Picture draw(const Camera& camera, RenderOptions options = {}) {
    options.size = size_;
    const double aspect = eyeSize(options.stereo, size_).aspect();
    figures_ = renderer_.draw(stereoViews(camera, aspect, separation_), options);
    return renderer_.read();
  }

  static inline std::unique_ptr<GraphicsContext> context_;
  Renderer renderer_{*context_};
  RenderFigures figures_;
  PictureSize size_{320, 200};
  double separation_ = 0;
  Camera camera_ = lookAt({0, 0, 100}, {0, 0, 0});
};

}  // namespace filiform::test
