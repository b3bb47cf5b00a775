// Lines, discs and letters as SVG, for pages that follow the reader's light or dark setting: what image.h draws as
// pixels. Colours of the palette become classes that the page's style sheet fills in (svgStyle()); others stay as they
// are. Thread rule: thread-compatible.
#pragma once

#include "tools/drawing/image.h"

#include <string>
#include <string_view>
#include <vector>

namespace filiform::tools {

class SvgCanvas {
 public:
  // Requires 1 <= width, height. `title` and `description` are read aloud in place of the picture.
  SvgCanvas(int width, int height, std::string title, std::string description);

  // As Canvas has them (image.h).
  void clip(int lo_x, int lo_y, int hi_x, int hi_y);
  void clipNothing();
  void polyline(const std::vector<Vector2d>& points, double width, Colour colour, double opacity = 1);
  void line(const Vector2d& a, const Vector2d& b, double width, Colour colour, double opacity = 1);
  void dashes(const Vector2d& a, const Vector2d& b, double width, Colour colour, double on, double off);
  void disc(const Vector2d& centre, double radius, Colour colour, double opacity = 1);
  void text(std::string_view utf8, const Vector2d& at, double height, Colour colour, Align align = Align::left,
            bool turned = false);
  static double textWidth(std::string_view utf8, double height);

  // The whole element. May be called once.
  std::string finish();

 private:
  int width_, height_;
  std::string title_, description_, body_;
  bool clipped_ = false;
  int clips_ = 0;
};

// The rules that an SvgCanvas' classes need, for a page's style sheet: light, and dark where the reader prefers it.
std::string svgStyle();

// Text as it may stand in HTML and SVG, also within an attribute.
std::string escapedMarkup(std::string_view text);

}  // namespace filiform::tools
