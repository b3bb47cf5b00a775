#include "viewer/gl/scene_frame.h"

#include "viewer/gl/graphics_context.h"

namespace filiform {

SceneBudget SceneBudget::of(const std::string& renderer_description) {
  if (!isSoftwareRenderer(renderer_description)) return {};
  return {.segments = 200'000,
          .moving_segments = 50'000,
          .samples = 2,
          .moving_samples = 1,
          .moving_shade = false,
          .upload_bytes = 1U << 20,
          .upload_ms = 20,  // beside some 100 ms of drawing
          .card_bytes = 256U << 20};
}

}  // namespace filiform
