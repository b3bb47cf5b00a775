#include "tools/drawing/image.h"

#include "index/errors.h"
#include "index/output.h"
#include "index/text.h"
#include "tools/drawing/image_font.h"
#include "tools/program/interruption.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <utility>

#include <png.h>

namespace filiform::tools {

namespace {

struct Glyph {
  int width = 0;
  std::vector<std::array<Vector2d, 2>> strokes;  // in dots, y down, baseline at 0
};

// Joins neighbouring dots by strokes: sideways and upright always, slanted if no upright path joins the two dots.
Glyph glyphFrom(const std::vector<std::string_view>& rows) {
  Glyph glyph;
  glyph.width = static_cast<int>(rows[0].size());
  const int height = static_cast<int>(rows.size());
  const auto on = [&](int x, int y) {
    return x >= 0 && y >= 0 && x < glyph.width && y < height &&
           rows[static_cast<std::size_t>(y)][static_cast<std::size_t>(x)] == '#';
  };
  const auto dot = [](int x, int y) { return Vector2d(x, y - font::kBaseline); };
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < glyph.width; ++x) {
      if (!on(x, y)) continue;
      bool joined = on(x - 1, y) || on(x, y - 1);
      const auto join = [&](int to_x, int to_y) {
        glyph.strokes.push_back({dot(x, y), dot(to_x, to_y)});
        joined = true;
      };
      if (on(x + 1, y)) join(x + 1, y);
      if (on(x, y + 1)) join(x, y + 1);
      if (on(x + 1, y + 1) && !on(x + 1, y) && !on(x, y + 1)) join(x + 1, y + 1);
      if (on(x - 1, y + 1) && !on(x - 1, y) && !on(x, y + 1)) join(x - 1, y + 1);
      if (!joined) glyph.strokes.push_back({dot(x, y), dot(x, y)});
    }
  }
  return glyph;
}

const Glyph& glyphOf(char32_t character) {
  static const std::map<char32_t, Glyph> kGlyphs = [] {
    std::map<char32_t, Glyph> glyphs;
    std::size_t next = 0;
    for (const auto& line : font::kLines) {
      for (std::size_t at = 0; at <= line[0].size();) {
        const std::size_t end = std::min(line[0].find('|', at), line[0].size());
        std::vector<std::string_view> rows;
        for (const std::string_view row : line) rows.push_back(row.substr(at, end - at));
        glyphs[font::kCharacters[next++]] = glyphFrom(rows);
        at = end + 1;
      }
    }
    return glyphs;
  }();
  const auto found = kGlyphs.find(character);
  return found == kGlyphs.end() ? kGlyphs.at(U'?') : found->second;
}

// Decodes UTF-8. Each invalid byte becomes U+FFFD.
std::u32string decode(std::string_view utf8) {
  std::u32string out;
  while (!utf8.empty()) {
    const Utf8Character character = decodeUtf8(utf8);
    out += character.length > 0 ? character.code_point : U'\ufffd';
    utf8.remove_prefix(std::max<std::size_t>(character.length, 1));
  }
  return out;
}

constexpr double kCapital = 6;      // dots from the baseline to the top of a capital, between centres
constexpr double kLetterGap = 1.9;  // dots from the last column of a letter to the first column of the next

double distanceToSegment(double x, double y, const Vector2d& a, const Vector2d& ab, double inverse_square) {
  const double px = x - a.x();
  const double py = y - a.y();
  const double t = std::clamp((px * ab.x() + py * ab.y()) * inverse_square, 0.0, 1.0);
  const double dx = px - t * ab.x();
  const double dy = py - t * ab.y();
  return std::sqrt(dx * dx + dy * dy);
}

}  // namespace

Colour mix(Colour a, Colour b, double t) {
  const auto channel = [t](std::uint8_t from, std::uint8_t to) {
    return static_cast<std::uint8_t>(std::lround(from + (static_cast<double>(to) - from) * t));
  };
  return {channel(a.r, b.r), channel(a.g, b.g), channel(a.b, b.b)};
}

namespace {

constexpr std::array<Colour, 7> kSeriesColours{
    {{0, 114, 178}, {213, 94, 0}, {0, 158, 115}, {204, 121, 167}, {230, 159, 0}, {86, 180, 233}, {60, 60, 60}}};

}  // namespace

Colour seriesColour(std::size_t index) { return kSeriesColours[index % kSeriesColours.size()]; }
std::size_t seriesColours() { return kSeriesColours.size(); }

Image::Image(int w, int h)
    : width(w), height(h), rgb(static_cast<std::size_t>(w) * static_cast<std::size_t>(h) * 3, 255) {}

Colour Image::at(int x, int y) const {
  const std::size_t i =
      (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)) * 3;
  return {rgb[i], rgb[i + 1], rgb[i + 2]};
}

std::string pngBytes(const Image& image) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  png.width = static_cast<png_uint_32>(image.width);
  png.height = static_cast<png_uint_32>(image.height);
  png.format = PNG_FORMAT_RGB;
  png.flags = PNG_IMAGE_FLAG_FAST;  // a third of the time; a dense picture grows by 1 %
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(png);
  std::string bytes(size, '\0');
  if (png_image_write_to_memory(&png, bytes.data(), &size, 0, image.rgb.data(), 0, nullptr) == 0)
    throw InputError(std::string("cannot encode the picture: ") + png.message);
  bytes.resize(size);
  return bytes;
}

void writePng(const Image& image, const std::string& path) {
  const std::string bytes = pngBytes(image);
  Output out(path, {.cancel = &interruptFlag()});
  out.write(bytes);
  out.finish();
}

Canvas::Canvas(Image& image)
    : image_(image),
      hi_x_(image.width),
      hi_y_(image.height),
      coverage_(static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height), 0.0F),
      used_lo_x_(image.width),
      used_lo_y_(image.height),
      used_hi_x_(0),
      used_hi_y_(0) {}

void Canvas::clip(int lo_x, int lo_y, int hi_x, int hi_y) {
  lo_x_ = std::clamp(lo_x, 0, image_.width);
  lo_y_ = std::clamp(lo_y, 0, image_.height);
  hi_x_ = std::clamp(hi_x, lo_x_, image_.width);
  hi_y_ = std::clamp(hi_y, lo_y_, image_.height);
}

void Canvas::clipNothing() { clip(0, 0, image_.width, image_.height); }

void Canvas::stroke(const Vector2d& a, const Vector2d& b, double width) {
  if (!a.allFinite() || !b.allFinite()) return;
  const double reach = width / 2 + 1;
  const auto pixel = [](double value, int lo, int hi) {
    return static_cast<int>(std::clamp(std::floor(value), static_cast<double>(lo), static_cast<double>(hi)));
  };
  const int x0 = pixel(std::min(a.x(), b.x()) - reach, lo_x_, hi_x_);
  const int x1 = pixel(std::max(a.x(), b.x()) + reach + 1, lo_x_, hi_x_);
  const int y0 = pixel(std::min(a.y(), b.y()) - reach, lo_y_, hi_y_);
  const int y1 = pixel(std::max(a.y(), b.y()) + reach + 1, lo_y_, hi_y_);
  if (x0 >= x1 || y0 >= y1) return;
  const Vector2d ab = b - a;
  const double square = ab.squaredNorm();
  const double inverse_square = square > 0 ? 1 / square : 0;
  // A line thinner than a pixel becomes paler.
  const double strength = std::min(1.0, width);
  const double half = std::max(width, 1.0) / 2;
  for (int y = y0; y < y1; ++y) {
    // Only the columns that the line can reach in this row.
    int from = x0;
    int to = x1;
    if (std::abs(ab.y()) > 1e-9) {
      const double t0 = (y + 0.5 - reach - a.y()) / ab.y();
      const double t1 = (y + 0.5 + reach - a.y()) / ab.y();
      const double lo_t = std::clamp(std::min(t0, t1), 0.0, 1.0);
      const double hi_t = std::clamp(std::max(t0, t1), 0.0, 1.0);
      const double lo_x = a.x() + ab.x() * (ab.x() > 0 ? lo_t : hi_t);
      const double hi_x = a.x() + ab.x() * (ab.x() > 0 ? hi_t : lo_t);
      from = std::max(x0, pixel(lo_x - reach, lo_x_, hi_x_));
      to = std::min(x1, pixel(hi_x + reach + 1, lo_x_, hi_x_));
    }
    float* row = &coverage_[static_cast<std::size_t>(y) * static_cast<std::size_t>(image_.width)];
    for (int x = from; x < to; ++x) {
      const double distance = distanceToSegment(x + 0.5, y + 0.5, a, ab, inverse_square);
      const double c = std::clamp(half + 0.5 - distance, 0.0, 1.0) * strength;
      row[x] = std::max(row[x], static_cast<float>(c));
    }
  }
  used_lo_x_ = std::min(used_lo_x_, x0);
  used_lo_y_ = std::min(used_lo_y_, y0);
  used_hi_x_ = std::max(used_hi_x_, x1);
  used_hi_y_ = std::max(used_hi_y_, y1);
}

void Canvas::paint(Colour colour, double opacity) {
  for (int y = used_lo_y_; y < used_hi_y_; ++y) {
    for (int x = used_lo_x_; x < used_hi_x_; ++x) {
      const std::size_t i =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(image_.width) + static_cast<std::size_t>(x);
      const float c = std::exchange(coverage_[i], 0.0F);
      if (c <= 0) continue;
      const Colour mixed = mix(image_.at(x, y), colour, c * opacity);
      image_.rgb[i * 3] = mixed.r;
      image_.rgb[i * 3 + 1] = mixed.g;
      image_.rgb[i * 3 + 2] = mixed.b;
    }
  }
  used_lo_x_ = image_.width;
  used_lo_y_ = image_.height;
  used_hi_x_ = used_hi_y_ = 0;
}

void Canvas::fill(double lo_x, double lo_y, double hi_x, double hi_y, Colour colour, double opacity) {
  const auto round = [](double value, int lo, int hi) {
    return static_cast<int>(std::clamp(std::floor(value + 0.5), static_cast<double>(lo), static_cast<double>(hi)));
  };
  const int x1 = round(hi_x, lo_x_, hi_x_);
  const int y1 = round(hi_y, lo_y_, hi_y_);
  used_lo_x_ = round(lo_x, lo_x_, hi_x_);
  used_lo_y_ = round(lo_y, lo_y_, hi_y_);
  used_hi_x_ = x1;
  used_hi_y_ = y1;
  for (int y = used_lo_y_; y < y1; ++y)
    for (int x = used_lo_x_; x < x1; ++x)
      coverage_[static_cast<std::size_t>(y) * static_cast<std::size_t>(image_.width) + static_cast<std::size_t>(x)] = 1;
  paint(colour, opacity);
}

void Canvas::polyline(const std::vector<Vector2d>& points, double width, Colour colour, double opacity) {
  if (points.size() == 1) stroke(points[0], points[0], width);
  for (std::size_t i = 1; i < points.size(); ++i) stroke(points[i - 1], points[i], width);
  paint(colour, opacity);
}

void Canvas::line(const Vector2d& a, const Vector2d& b, double width, Colour colour, double opacity) {
  stroke(a, b, width);
  paint(colour, opacity);
}

void Canvas::dashes(const Vector2d& a, const Vector2d& b, double width, Colour colour, double on, double off) {
  const double length = (b - a).norm();
  if (!(length > 0) || !std::isfinite(length)) return;
  const Vector2d direction = (b - a) / length;
  for (double at = 0; at < length; at += on + off)
    stroke(a + at * direction, a + std::min(length, at + on) * direction, width);
  paint(colour, 1);
}

void Canvas::disc(const Vector2d& centre, double radius, Colour colour, double opacity) {
  line(centre, centre, 2 * radius, colour, opacity);
}

double Canvas::textWidth(std::string_view utf8, double height) {
  double dots = 0;
  for (const char32_t character : decode(utf8)) dots += glyphOf(character).width - 1 + kLetterGap;
  return std::max(0.0, dots - kLetterGap) * height / kCapital;
}

void Canvas::text(std::string_view utf8, const Vector2d& at, double height, Colour colour, Align align, bool turned) {
  const double scale = height / kCapital;
  const double width = textWidth(utf8, height);
  double pen = align == Align::left ? 0 : align == Align::centre ? -width / 2 : -width;
  const auto place = [&](const Vector2d& dot) {
    const Vector2d p(pen + dot.x() * scale, dot.y() * scale);
    return turned ? Vector2d(at.x() + p.y(), at.y() - p.x()) : Vector2d(at + p);
  };
  for (const char32_t character : decode(utf8)) {
    const Glyph& glyph = glyphOf(character);
    for (const auto& [a, b] : glyph.strokes) stroke(place(a), place(b), std::max(1.15, height * 0.135));
    pen += (glyph.width - 1 + kLetterGap) * scale;
  }
  paint(colour, 1);
}

}  // namespace filiform::tools
