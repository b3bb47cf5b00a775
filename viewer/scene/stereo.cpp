#include "viewer/scene/stereo.h"

#include "index/errors.h"
#include "index/text.h"

#include <algorithm>
#include <cmath>

namespace filiform {

const char* toString(StereoMode mode) noexcept {
  switch (mode) {
    case StereoMode::mono:
      return "mono";
    case StereoMode::anaglyph:
      return "anaglyph";
    case StereoMode::side_by_side:
      return "side-by-side";
    case StereoMode::top_bottom:
      return "top-bottom";
    case StereoMode::row_interleaved:
      return "row-interleaved";
    case StereoMode::quad_buffer:
      return "quad-buffer";
  }
  return "";
}

StereoMode stereoMode(const std::string& name) {
  if (name == toString(StereoMode::quad_buffer)) return StereoMode::quad_buffer;
  std::string choices;
  for (const StereoMode mode : kStereoModes) {
    if (name == toString(mode)) return mode;
    choices += (choices.empty() ? "" : ", ") + std::string(toString(mode));
  }
  throw UsageError("stereo mode " + inShort(name) + ": choose one of " + choices);
}

PictureSize eyeSize(StereoMode mode, const PictureSize& size) {
  if (mode == StereoMode::side_by_side) return {std::max(1, size.width / 2), size.height};
  if (mode == StereoMode::top_bottom) return {size.width, std::max(1, size.height / 2)};
  return size;
}

double separationRatio(const StereoOptions& options, double convergence_um, double nearest_um, double farthest_um,
                       double width_tan) {
  const double largest_um = options.largest_parallax * 2 * convergence_um * width_tan;  // on the plane of convergence
  double separation_um = INFINITY;
  for (const double depth_um : {nearest_um, farthest_um}) {
    const double away_um = std::abs(depth_um - convergence_um);
    if (away_um > 0) separation_um = std::min(separation_um, largest_um * depth_um / away_um);
  }
  return options.gain * std::clamp(separation_um / convergence_um, kMinSeparation, kMaxSeparation);
}

std::array<EyeView, 2> stereoViews(const Camera& camera, double aspect, double separation_ratio, double widening) {
  std::array<EyeView, 2> views{viewOf(camera, aspect, widening), viewOf(camera, aspect, widening)};
  const double half_um = separation_ratio * camera.focus_um / 2;
  const double shift_um = half_um * camera.near_um / camera.focus_um;
  for (int eye = 0; eye < 2; ++eye) {
    const double side = eye == 0 ? -1 : 1;
    EyeView& view = views[static_cast<std::size_t>(eye)];
    view.eye_W += side * half_um * camera.rotation_VW.row(0).transpose();
    view.frustum.left -= side * shift_um;
    view.frustum.right -= side * shift_um;
  }
  return views;
}

double SeparationFilter::update(double target, double dt_s) noexcept {
  if (ratio_ < 0) return ratio_ = target;
  if (dt_s > 0) ratio_ += (target - ratio_) * -std::expm1(-dt_s / kTime_s);
  return ratio_;
}

}  // namespace filiform
