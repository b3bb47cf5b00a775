// Stereo views: two parallel eyes whose shifted frusta meet at the point of convergence. The eyes are not turned
// inwards, because that would shift points up and down. With eye separation e and distance of convergence d, a point at
// depth z has the parallax e (z - d) / z on the plane of convergence: zero at the proxy, uncrossed behind it. (Bourke,
// Calculating stereo pairs.) Immutable values, except SeparationFilter, which is thread-compatible.
#pragma once

#include "viewer/scene/camera.h"

#include <array>
#include <string>

namespace filiform {

enum class StereoMode : std::uint8_t {
  mono,
  anaglyph,         // red: left eye's luminance; green and blue: right eye's, half as pure
  side_by_side,     // left eye in the left half; each with its true proportions
  top_bottom,       // left eye in the upper half
  row_interleaved,  // left eye in rows 0, 2, 4 ... from the top, for polarised screens
  quad_buffer,      // a separate picture for each eye, shown in turn; needs a window with quad-buffer stereo
};
// The modes that any window can show.
inline constexpr StereoMode kStereoModes[] = {StereoMode::mono, StereoMode::anaglyph, StereoMode::side_by_side,
                                              StereoMode::top_bottom, StereoMode::row_interleaved};
const char* toString(StereoMode mode) noexcept;  // "side-by-side"
StereoMode stereoMode(const std::string& name);  // accepts quad_buffer too; throws UsageError that lists the choices

// The size of one eye's picture within a picture of `size` (at least 1 x 1).
PictureSize eyeSize(StereoMode mode, const PictureSize& size);

struct StereoOptions {
  // Largest parallax as a part of the picture's width. 1.75 % is 1 degree on a 27 inch screen at 60 cm: within it,
  // fusion needs no effort (Lambooij et al. 2009).
  double largest_parallax = 0.0175;
  double gain = 1;  // the user's factor on the separation; 0: both eyes see the same
  double widening =
      1;  // factor on the tangent of the projection angle: a wider view eases fusion (the paper, section 4)
};

// Bounds of the separation divided by the distance of convergence: flat scenes are not exaggerated without limit, and
// some depth always remains.
inline constexpr double kMinSeparation = 1.0 / 200, kMaxSeparation = 1.0 / 14;

// The largest separation, divided by the distance of convergence, at which no point between the depths `nearest_um` and
// `farthest_um` (0 < nearest <= farthest) exceeds the largest parallax. Clamped to the bounds above, then multiplied by
// the gain. `width_tan`: half the picture's width divided by its distance, mono, before widening.
double separationRatio(const StereoOptions& options, double convergence_um, double nearest_um, double farthest_um,
                       double width_tan);

// The views of the left and the right eye, converging at `camera.focus_um`.
std::array<EyeView, 2> stereoViews(const Camera& camera, double aspect, double separation_ratio, double widening = 1);

// Approaches the target ratio so slowly that users do not notice the change (Ware et al. 1998: over some seconds).
class SeparationFilter {
 public:
  static constexpr double kTime_s = 0.7;  // 95 % within 2.1 s

  // Returns the ratio to use now. The first call returns the target itself. A dt_s that is not > 0 changes nothing.
  double update(double target, double dt_s) noexcept;

 private:
  double ratio_ = -1;
};

}  // namespace filiform
