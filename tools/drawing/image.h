// A small raster image for plots and pictures: anti-aliased lines, discs and letters on white, written as PNG.
// Thread rule: thread-compatible; the functions have no state.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

namespace filiform::tools {

using Eigen::Vector2d;

struct Colour {
  std::uint8_t r = 0, g = 0, b = 0;

  friend bool operator==(const Colour&, const Colour&) = default;
};

// The colour between `a` (t = 0) and `b` (t = 1).
Colour mix(Colour a, Colour b, double t);

inline constexpr Colour kWhite{255, 255, 255};
inline constexpr Colour kInk{38, 38, 43};
inline constexpr Colour kGrey{120, 120, 128};
inline constexpr Colour kGridLine{232, 232, 236};
inline constexpr Colour kFinerGridLine{244, 244, 246};

// Colours that readers with any form of colour blindness can distinguish: the palette of Okabe and Ito without yellow.
Colour seriesColour(std::size_t index);
std::size_t seriesColours();  // the number of colours before they repeat

struct Image {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;  // rows from the top, three bytes a pixel

  Image() = default;
  // White. Requires 1 <= width, height <= 16384.
  Image(int width, int height);
  Colour at(int x, int y) const;
};

// The image as PNG. Throws InputError if libpng refuses the size.
std::string pngBytes(const Image& image);
// Writes PNG through Output (index/output.h): a file is replaced after everything is written. Throws as Output does.
void writePng(const Image& image, const std::string& path);

enum class Align { left, centre, right };

// Draws on an image. Coordinates are pixels: x to the right, y down, (0, 0) at the top left corner of the first pixel.
// Shapes are clipped to the image. Shapes with a coordinate that is not finite are left out.
class Canvas {
 public:
  explicit Canvas(Image& image);

  // Restricts drawing to lo <= p < hi.
  void clip(int lo_x, int lo_y, int hi_x, int hi_y);
  void clipNothing();

  void fill(double lo_x, double lo_y, double hi_x, double hi_y, Colour colour, double opacity = 1);
  // Draws one shape: where it crosses itself, the opacity does not add up.
  void polyline(const std::vector<Vector2d>& points, double width, Colour colour, double opacity = 1);
  void line(const Vector2d& a, const Vector2d& b, double width, Colour colour, double opacity = 1);
  void dashes(const Vector2d& a, const Vector2d& b, double width, Colour colour, double on, double off);
  void disc(const Vector2d& centre, double radius, Colour colour, double opacity = 1);

  // Draws UTF-8 text. A question mark replaces letters that the font lacks. `height`: of a capital. `at`: a point on
  // the baseline. `turned`: the text runs upwards. O(strokes x their pixels).
  void text(std::string_view utf8, const Vector2d& at, double height, Colour colour, Align align = Align::left,
            bool turned = false);
  static double textWidth(std::string_view utf8, double height);

 private:
  void stroke(const Vector2d& a, const Vector2d& b, double width);
  void paint(Colour colour, double opacity);

  Image& image_;
  int lo_x_ = 0, lo_y_ = 0, hi_x_, hi_y_;  // clip
  // Coverage of the shape being drawn, and the range of columns and rows where it is not zero.
  std::vector<float> coverage_;
  int used_lo_x_, used_lo_y_, used_hi_x_, used_hi_y_;
};

}  // namespace filiform::tools
