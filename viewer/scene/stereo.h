// Two eyes: parallel, with frusta shifted so that they meet at the point of convergence (never turned inwards, which
// would shift points up and down). A point at depth z then has the parallax e (z - d) / z on the plane of convergence,
// e the separation of the eyes and d the distance: zero at the proxy, uncrossed behind it. (Bourke, Calculating stereo
// pairs.) Immutable values but for SeparationFilter, which is thread-compatible.
#pragma once

#include "viewer/scene/camera.h"

#include <array>
#include <string>

namespace filiform {

enum class StereoMode : std::uint8_t {
  mono,
  anaglyph,         // red and cyan, the left eye's luminance in red, the right eye's green and blue, half as pure
  side_by_side,     // left eye in the left half, each in its right proportions
  top_bottom,       // left eye above
  row_interleaved,  // left eye in rows 0, 2, 4 ... from the top, for polarised screens
  quad_buffer,      // a picture for each eye, which the screen shows by turns: only in windows that have it
};
// Those that need no special window.
inline constexpr StereoMode kStereoModes[] = {StereoMode::mono, StereoMode::anaglyph, StereoMode::side_by_side,
                                              StereoMode::top_bottom, StereoMode::row_interleaved};
const char* toString(StereoMode mode) noexcept;  // "side-by-side"
StereoMode stereoMode(const std::string& name);  // quad_buffer too; throws UsageError naming the choices

// What one eye's picture measures within a picture of that size (at least 1 x 1).
PictureSize eyeSize(StereoMode mode, const PictureSize& size);

struct StereoOptions {
  // Largest parallax as a part of the picture's width: 1.75 % is 1 degree for a 27 inch screen at 60 cm, within which
  // fusing is no effort (Lambooij et al. 2009).
  double largest_parallax = 0.0175;
  double gain = 1;      // the person's own, on the separation; 0: both eyes see the same
  double widening = 1;  // of the tangent of the projection angle: a wider picture eases fusion (the paper, 4)
};

// Separation over distance of convergence, kept within these: flat scenes are not exaggerated without end, and some
// depth is always left.
inline constexpr double kMinSeparation = 1.0 / 200, kMaxSeparation = 1.0 / 14;

// Separation over distance of convergence with which nothing between `nearest_um` and `farthest_um` (depths, 0 <
// nearest <= farthest) has more than the largest parallax; clamped as above, then times the gain. `width_tan`: half the
// picture's width over the distance, mono, before widening.
double separationRatio(const StereoOptions& options, double convergence_um, double nearest_um, double farthest_um,
                       double width_tan);

// The views of the left and the right eye, converging at `camera.focus_um`.
std::array<EyeView, 2> stereoViews(const Camera& camera, double aspect, double separation_ratio, double widening = 1);

// Follows the wished ratio slowly, so that the change goes unnoticed (Ware et al. 1998: over some seconds).
class SeparationFilter {
 public:
  static constexpr double kTime_s = 0.7;  // 95 % within 2.1 s

  // The first call takes the wish as it is. A dt that is not > 0 changes nothing. Returns the ratio to be used now.
  double follow(double wish, double dt_s) noexcept;

 private:
  double ratio_ = -1;
};

}  // namespace filiform
