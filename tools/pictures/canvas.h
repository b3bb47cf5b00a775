// Draws lines, discs and letters with Cairo: on a picture, or as SVG or PDF.
//
//   Picture picture = whitePicture(1200, 500);
//   Canvas(picture).text("Force at the hand", {20, 30}, 12, kInk);
//
// Thread rule: thread-compatible; the functions have no state.
#pragma once

#include "viewer/gl/renderer.h"
#include "viewer/scene/colour.h"

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

struct _cairo;
struct _cairo_surface;

namespace filiform::tools {

using Eigen::Vector2d;

// The colour between `a` (t = 0) and `b` (t = 1).
Rgba mix(Rgba a, Rgba b, double t);

inline constexpr Rgba kWhite{255, 255, 255};
inline constexpr Rgba kInk{38, 38, 43};
inline constexpr Rgba kGrey{120, 120, 128};
inline constexpr Rgba kGridLine{232, 232, 236};
inline constexpr Rgba kFinerGridLine{244, 244, 246};

// Colours that readers with any form of colour blindness can distinguish: the palette of Okabe and Ito without yellow.
// They repeat after seven.
Rgba seriesColour(std::size_t index);

// Requires 1 <= width, height <= 16384.
Picture whitePicture(int width, int height);

enum class Align { left, centre, right };
enum class VectorFormat { svg, pdf };

// Coordinates are pixels: x to the right, y down, (0, 0) at the top left corner of the first pixel. Shapes are clipped
// to the picture. Shapes with a coordinate that is not finite or beyond 1e6 are left out.
class Canvas {
 public:
  // Draws on the picture, which must not be read before the canvas is destroyed. Throws std::bad_alloc.
  explicit Canvas(Picture& picture);
  // Draws a document of this size, each pixel `pixel_mm` wide; 0: SVG in pixels, PDF with 96 pixels an inch. `document`
  // is whole when the canvas is destroyed.
  Canvas(int width, int height, std::string& document, VectorFormat format = VectorFormat::svg, double pixel_mm = 0);
  ~Canvas();
  Canvas(const Canvas&) = delete;
  Canvas& operator=(const Canvas&) = delete;

  // Restricts drawing to lo <= p < hi.
  void clip(double lo_x, double lo_y, double hi_x, double hi_y);
  void clipNothing();

  // A picture with its top left corner at (0, 0).
  void picture(const Picture& drawn);
  // A rectangle with its edges moved to the nearest pixels.
  void fill(double lo_x, double lo_y, double hi_x, double hi_y, Rgba colour);
  // Draws one shape: where it crosses itself, the opacity does not add up.
  void polyline(const std::vector<Vector2d>& points, double width, Rgba colour);
  void line(const Vector2d& a, const Vector2d& b, double width, Rgba colour);
  void dashes(const Vector2d& a, const Vector2d& b, double width, Rgba colour, double on, double off);
  void disc(const Vector2d& centre, double radius, Rgba colour);
  // A line with round ends, as wide at each end as twice its radius.
  void taper(const Vector2d& a, double radius_a, const Vector2d& b, double radius_b, Rgba colour);

  // Draws UTF-8 text in DejaVu Sans, or the font that the system has instead. Bytes that are not UTF-8 are escaped.
  // `height`: of a capital. `at`: a point on the baseline. `turned`: the text runs upwards.
  void text(std::string_view utf8, const Vector2d& at, double height, Rgba colour, Align align = Align::left,
            bool turned = false);
  double textWidth(std::string_view utf8, double height);

 private:
  void begin();
  bool trace(const std::vector<Vector2d>& points, double width, Rgba colour);

  Picture* picture_ = nullptr;
  _cairo_surface* surface_;
  _cairo* cairo_ = nullptr;
};

}  // namespace filiform::tools
