#include "viewer/window/travel/internal/screenshots.h"

#include "index/text.h"
#include "viewer/window/settings/internal/text_format.h"

#include <algorithm>
#include <chrono>
#include <ctime>
#include <exception>
#include <thread>

namespace filiform::internal {

namespace {

// The share of a frame that drawing a picture takes: the window keeps 30 frames a second or more.
constexpr double kDrawing_ms = 15;

}  // namespace

void Screenshots::begin(SceneFrame frame, int times, const TileStore& store, const Levels* levels,
                        GraphicsContext& context) {
  if (large_) return messages_.say("a picture is already being drawn (Esc cancels it)");
  const int most = Renderer::kMaxSize / std::max(frame.size.width, frame.size.height);
  const int factor = std::clamp(times, 1, std::max(most, 1));
  frame.size = {frame.size.width * factor, frame.size.height * factor};
  frame.overlay_scale *= factor;
  large_ = std::make_unique<LargePicture>(store, levels, context, frame);
}

void Screenshots::advance() {
  if (!large_) return;
  try {
    large_->advance(kDrawing_ms);
    if (!large_->isDone()) return;
    save(large_->take());
  } catch (const std::exception& error) {
    messages_.say(error.what());
  }
  drop();
}

void Screenshots::cancel() {
  if (!large_) return;
  drop();
  messages_.say("the picture is cancelled");
}

void Screenshots::drop() {
  if (!large_) return;
  closing_.begin([loader = large_->end()]() mutable { loader.reset(); });
  large_.reset();
}

// Encoding and writing a large picture takes a second: not on the window's thread.
void Screenshots::save(Picture picture) {
  const std::time_t now = std::time(nullptr);
  std::tm local{};
  localtime_r(&now, &local);
  char stamp[32];
  std::strftime(stamp, sizeof stamp, "%Y%m%d-%H%M%S", &local);
  std::string path = folder_ + "/filiform-" + stamp + "-" + std::to_string(++asked_) + ".png";
  writer_.ask(
      [this, path = std::move(path), picture = std::make_shared<const Picture>(std::move(picture))]() -> Worker::Done {
        write_(*picture, path);
        return [this, path, width = picture->width, height = picture->height] {
          ++written_;
          last_path_ = path;
          messages_.say(format("%d x %d pixels: ", width, height) + inShort(path));
        };
      });
}

void Screenshots::serve() {
  writer_.serve([this](const std::string& failure) { messages_.say(failure); });
}

std::string Screenshots::finish() {
  std::string failure;
  while (!writer_.idle()) {
    writer_.serve([&](const std::string& why) { failure = why; });
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return failure;
}

std::string Screenshots::text() const {
  if (large_) return format("picture of %d x %d pixels", large_->size().width, large_->size().height);
  return writer_.idle() ? "" : "writing the picture";
}

}  // namespace filiform::internal
