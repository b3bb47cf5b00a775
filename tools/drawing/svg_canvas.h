// Draws lines, discs and letters as SVG, with the functions of Canvas (image.h). Palette colours become classes, so
// that the page's style sheet (svgStyle()) follows the reader's light or dark setting. Other colours stay unchanged.
// Thread rule: thread-compatible.
#pragma once

#include "tools/drawing/image.h"

#include <string>
#include <string_view>
#include <vector>

namespace filiform::tools {

class SvgCanvas {
 public:
  // Requires 1 <= width, height. Screen readers read `title` and `description` instead of the picture.
  SvgCanvas(int width, int height, std::string title, std::string description);

  // As in Canvas (image.h).
  void clip(int lo_x, int lo_y, int hi_x, int hi_y);
  void clipNothing();
  void polyline(const std::vector<Vector2d>& points, double width, Colour colour, double opacity = 1);
  void line(const Vector2d& a, const Vector2d& b, double width, Colour colour, double opacity = 1);
  void dashes(const Vector2d& a, const Vector2d& b, double width, Colour colour, double on, double off);
  void disc(const Vector2d& centre, double radius, Colour colour, double opacity = 1);
  void text(std::string_view utf8, const Vector2d& at, double height, Colour colour, Align align = Align::left,
            bool turned = false);
  static double textWidth(std::string_view utf8, double height);

  // Returns the whole SVG element. May be called once.
  std::string finish();

 private:
  int width_, height_;
  std::string title_, description_, body_;
  bool clipped_ = false;
  int clips_ = 0;
};

// The style rules for the classes of SvgCanvas: light, and dark if the reader prefers dark pages.
std::string svgStyle();

// Escapes text for HTML and SVG, also inside an attribute.
std::string escapedMarkup(std::string_view text);

}  // namespace filiform::tools
