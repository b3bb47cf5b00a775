#include "tools/drawing/svg_canvas.h"

#include <cmath>
#include <cstdio>
#include <functional>
#include <utility>

namespace filiform::tools {

namespace {

constexpr double kCapitalPart = 0.72,
                 kMeanLetterPart = 0.55;  // of the size of a sans-serif font: a capital, a mean letter's width

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2f", value);
  std::string digits = text;
  while (digits.back() == '0') digits.pop_back();
  if (digits.back() == '.') digits.pop_back();
  return digits == "-0" ? "0" : digits;
}

std::string hex(Colour c) {
  char text[8];
  std::snprintf(text, sizeof text, "#%02x%02x%02x", c.r, c.g, c.b);
  return text;
}

// The name of a palette colour; empty for other colours.
std::string nameOf(Colour c) {
  if (c == kInk) return "ink";
  if (c == kGrey) return "grey";
  if (c == kWhite) return "paper";
  if (c == kGridLine) return "grid";
  if (c == kFinerGridLine) return "finer";
  for (std::size_t i = 0; i < seriesColours(); ++i)
    if (c == seriesColour(i)) return "s" + std::to_string(i);
  return "";
}

// The attribute of a stroked ("k") or filled ("f") shape.
std::string painted(Colour c, bool stroked) {
  const std::string name = nameOf(c);
  if (!name.empty()) return std::string(" class=\"") + (stroked ? "k-" : "f-") + name + "\"";
  return std::string(stroked ? " stroke=\"" : " fill=\"") + hex(c) + "\"";
}

std::string opaque(double opacity) { return opacity < 1 ? " opacity=\"" + number(opacity) + "\"" : ""; }

bool finite(const Vector2d& p) { return std::isfinite(p.x()) && std::isfinite(p.y()); }

}  // namespace

std::string escapedMarkup(std::string_view text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

SvgCanvas::SvgCanvas(int width, int height, std::string title, std::string description)
    : width_(width), height_(height), title_(std::move(title)), description_(std::move(description)) {}

void SvgCanvas::clip(int lo_x, int lo_y, int hi_x, int hi_y) {
  clipNothing();
  // Ids must differ within a page, which has many pictures.
  const std::string id =
      "c" + std::to_string(std::hash<std::string>{}(title_ + "\n" + description_)) + "-" + std::to_string(clips_++);
  body_ += "<clipPath id=\"" + id + "\"><rect x=\"" + std::to_string(lo_x) + "\" y=\"" + std::to_string(lo_y) +
           "\" width=\"" + std::to_string(hi_x - lo_x) + "\" height=\"" + std::to_string(hi_y - lo_y) +
           "\"/></clipPath>\n<g clip-path=\"url(#" + id + ")\">\n";
  clipped_ = true;
}

void SvgCanvas::clipNothing() {
  if (clipped_) body_ += "</g>\n";
  clipped_ = false;
}

void SvgCanvas::polyline(const std::vector<Vector2d>& points, double width, Colour colour, double opacity) {
  std::string way;
  for (const Vector2d& p : points) {
    if (!finite(p)) return;
    if (!way.empty()) way += ' ';
    way += number(p.x()) + "," + number(p.y());
  }
  body_ += "<polyline fill=\"none\"" + painted(colour, true) + " stroke-width=\"" + number(width) +
           "\" stroke-linejoin=\"round\"" + opaque(opacity) + " points=\"" + way + "\"/>\n";
}

void SvgCanvas::line(const Vector2d& a, const Vector2d& b, double width, Colour colour, double opacity) {
  polyline({a, b}, width, colour, opacity);
}

void SvgCanvas::dashes(const Vector2d& a, const Vector2d& b, double width, Colour colour, double on, double off) {
  if (!finite(a) || !finite(b)) return;
  body_ += "<line" + painted(colour, true) + " stroke-width=\"" + number(width) + "\" stroke-dasharray=\"" +
           number(on) + " " + number(off) + "\" x1=\"" + number(a.x()) + "\" y1=\"" + number(a.y()) + "\" x2=\"" +
           number(b.x()) + "\" y2=\"" + number(b.y()) + "\"/>\n";
}

void SvgCanvas::disc(const Vector2d& centre, double radius, Colour colour, double opacity) {
  if (!finite(centre)) return;
  body_ += "<circle" + painted(colour, false) + " cx=\"" + number(centre.x()) + "\" cy=\"" + number(centre.y()) +
           "\" r=\"" + number(radius) + "\"" + opaque(opacity) + "/>\n";
}

void SvgCanvas::text(std::string_view utf8, const Vector2d& at, double height, Colour colour, Align align,
                     bool turned) {
  if (!finite(at) || utf8.empty()) return;
  const char* const anchors[] = {"start", "middle", "end"};
  body_ += "<text" + painted(colour, false) + " font-size=\"" + number(height / kCapitalPart) + "\" text-anchor=\"" +
           anchors[static_cast<int>(align)] + "\"";
  if (turned)
    body_ += " transform=\"translate(" + number(at.x()) + " " + number(at.y()) + ") rotate(-90)\"";
  else
    body_ += " x=\"" + number(at.x()) + "\" y=\"" + number(at.y()) + "\"";
  body_ += ">" + escapedMarkup(utf8) + "</text>\n";
}

double SvgCanvas::textWidth(std::string_view utf8, double height) {
  std::size_t letters = 0;
  for (const char c : utf8) letters += (static_cast<unsigned char>(c) & 0xC0) != 0x80;
  return static_cast<double>(letters) * kMeanLetterPart * height / kCapitalPart;
}

std::string SvgCanvas::finish() {
  clipNothing();
  std::string out = "<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" viewBox=\"0 0 ";
  out += std::to_string(width_) + " " + std::to_string(height_) + "\" width=\"" + std::to_string(width_) +
         "\" height=\"" + std::to_string(height_) + "\">\n<title>" + escapedMarkup(title_) + "</title>\n<desc>" +
         escapedMarkup(description_) + "</desc>\n" + body_ + "</svg>\n";
  return out;
}

std::string svgStyle() {
  struct Shade {
    std::string name, light, dark;
  };
  std::vector<Shade> shades{{"ink", hex(kInk), "#e4e4e8"},
                            {"grey", hex(kGrey), "#9a9aa4"},
                            {"paper", hex(kWhite), "#16161a"},
                            {"grid", hex(kGridLine), "#33333a"},
                            {"finer", hex(kFinerGridLine), "#25252a"}};
  for (std::size_t i = 0; i < seriesColours(); ++i)
    shades.push_back({"s" + std::to_string(i), hex(seriesColour(i)), hex(mix(seriesColour(i), kWhite, 0.35))});
  std::string light = ":root {", dark = "@media screen and (prefers-color-scheme: dark) { :root {", rules;
  for (const Shade& shade : shades) {
    light += " --" + shade.name + ": " + shade.light + ";";
    dark += " --" + shade.name + ": " + shade.dark + ";";
    rules += ".k-" + shade.name + " { stroke: var(--" + shade.name + "); } .f-" + shade.name + " { fill: var(--" +
             shade.name + "); }\n";
  }
  return light + " }\n" + dark + " } }\n" + rules + "svg text { font-family: system-ui, sans-serif; }\n";
}

}  // namespace filiform::tools
