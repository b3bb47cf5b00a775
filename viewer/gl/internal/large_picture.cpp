#include "viewer/gl/internal/large_picture.h"

#include <chrono>

namespace filiform::internal {

namespace {

constexpr int kRowsRead = 64;
constexpr double kDrawing = 0.9;  // part of the work; the rest is reading the pixels back

}  // namespace

LargePicture::LargePicture(const TileStore& store, const Levels* levels, GraphicsContext& context,
                           const SceneFrame& frame)
    : frame_(frame), renderer_(context), view_(store, levels, renderer_) {
  if (frame.workspace != nullptr) frame_.workspace = &workspace_.emplace(*frame.workspace);
  if (frame.junction != nullptr) frame_.junction = &junction_.emplace(*frame.junction);
}

void LargePicture::advance(double most_ms) {
  if (isDone()) return;
  if (!drawn_) {
    const double part = view_.advanceWhole(frame_, most_ms);
    drawn_ = part >= 1;
    done_ = kDrawing * part;
    return;
  }
  const auto begin = std::chrono::steady_clock::now();
  do {
    if (renderer_.readMore(picture_, kRowsRead)) {
      done_ = 1;
      return;
    }
    const auto read = static_cast<double>(picture_.rgb.size());
    done_ = kDrawing + (1 - kDrawing) * read / (3.0 * picture_.width * picture_.height);
  } while (std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count() < most_ms);
}

}  // namespace filiform::internal
