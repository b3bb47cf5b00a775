#include "tools/pictures/canvas.h"

#include "index/text.h"

#include <array>
#include <cairo-pdf.h>
#include <cairo-svg.h>
#include <cairo.h>
#include <cmath>
#include <cstdint>
#include <new>

namespace filiform::tools {

namespace {

constexpr double kCapitalPart = 0.729;  // height of a capital of DejaVu Sans, in sizes of the font

constexpr std::array<Rgba, 7> kSeriesColours{
    {{0, 114, 178}, {213, 94, 0}, {0, 158, 115}, {204, 121, 167}, {230, 159, 0}, {86, 180, 233}, {60, 60, 60}}};

void setColour(cairo_t* cairo, Rgba c) {
  cairo_set_source_rgba(cairo, c.r / 255.0, c.g / 255.0, c.b / 255.0, c.a / 255.0);
}

// False also for NaN. Cairo's coordinates end at 8e6.
bool isNear(double coordinate) { return std::abs(coordinate) <= 1e6; }
bool isNear(const Vector2d& p) { return isNear(p.x()) && isNear(p.y()); }

std::uint32_t* pixelsOf(cairo_surface_t* surface) {
  return reinterpret_cast<std::uint32_t*>(cairo_image_surface_get_data(surface));
}

cairo_surface_t* surfaceOf(const Picture& picture) {
  cairo_surface_t* const surface = cairo_image_surface_create(CAIRO_FORMAT_RGB24, picture.width, picture.height);
  if (cairo_surface_status(surface) != CAIRO_STATUS_SUCCESS) throw std::bad_alloc();
  std::uint32_t* const pixels = pixelsOf(surface);  // 0x00RRGGBB
  for (std::size_t i = 0; i < picture.rgb.size() / 3; ++i) {
    const std::uint8_t* const c = &picture.rgb[3 * i];
    pixels[i] = static_cast<std::uint32_t>(c[0] << 16 | c[1] << 8 | c[2]);
  }
  cairo_surface_mark_dirty(surface);
  return surface;
}

}  // namespace

Rgba mix(Rgba a, Rgba b, double t) {
  const auto channel = [t](std::uint8_t from, std::uint8_t to) {
    return static_cast<std::uint8_t>(std::lround(from + (static_cast<double>(to) - from) * t));
  };
  return {channel(a.r, b.r), channel(a.g, b.g), channel(a.b, b.b), channel(a.a, b.a)};
}

Rgba seriesColour(std::size_t index) { return kSeriesColours[index % kSeriesColours.size()]; }

Picture whitePicture(int width, int height) {
  const std::size_t bytes = static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 3;
  return {width, height, std::vector<std::uint8_t>(bytes, 255)};
}

Canvas::Canvas(Picture& picture) : picture_(&picture), surface_(surfaceOf(picture)) { begin(); }

Canvas::Canvas(int width, int height, std::string& document, VectorFormat format, double pixel_mm) {
  const bool is_svg = format == VectorFormat::svg;
  const double unit = is_svg ? (pixel_mm > 0 ? pixel_mm : 1) : (pixel_mm > 0 ? pixel_mm / 25.4 : 1.0 / 96) * 72;
  const auto append = [](void* to, const unsigned char* bytes, unsigned n) {
    static_cast<std::string*>(to)->append(reinterpret_cast<const char*>(bytes), n);
    return CAIRO_STATUS_SUCCESS;
  };
  surface_ = (is_svg ? cairo_svg_surface_create_for_stream : cairo_pdf_surface_create_for_stream)(
      append, &document, width * unit, height * unit);
  if (is_svg) cairo_svg_surface_set_document_unit(surface_, pixel_mm > 0 ? CAIRO_SVG_UNIT_MM : CAIRO_SVG_UNIT_PX);
  begin();
  cairo_scale(cairo_, unit, unit);
}

void Canvas::begin() {
  if (cairo_surface_status(surface_) != CAIRO_STATUS_SUCCESS) throw std::bad_alloc();
  cairo_ = cairo_create(surface_);
  cairo_set_line_join(cairo_, CAIRO_LINE_JOIN_ROUND);
  cairo_select_font_face(cairo_, "DejaVu Sans", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
  // Letters have the same widths on a picture and in SVG.
  cairo_font_options_t* const options = cairo_font_options_create();
  cairo_font_options_set_antialias(options, CAIRO_ANTIALIAS_GRAY);
  cairo_font_options_set_hint_style(options, CAIRO_HINT_STYLE_NONE);
  cairo_font_options_set_hint_metrics(options, CAIRO_HINT_METRICS_OFF);
  cairo_set_font_options(cairo_, options);
  cairo_font_options_destroy(options);
}

Canvas::~Canvas() {
  cairo_destroy(cairo_);
  if (picture_ != nullptr) {
    cairo_surface_flush(surface_);
    const std::uint32_t* const pixels = pixelsOf(surface_);
    for (std::size_t i = 0; i < picture_->rgb.size(); ++i)
      picture_->rgb[i] = static_cast<std::uint8_t>(pixels[i / 3] >> (16 - 8 * (i % 3)));
  }
  cairo_surface_destroy(surface_);  // completes the SVG
}

void Canvas::clip(double lo_x, double lo_y, double hi_x, double hi_y) {
  clipNothing();
  cairo_rectangle(cairo_, lo_x, lo_y, hi_x - lo_x, hi_y - lo_y);
  cairo_clip(cairo_);
}

void Canvas::clipNothing() { cairo_reset_clip(cairo_); }

void Canvas::picture(const Picture& drawn) {
  cairo_surface_t* const surface = surfaceOf(drawn);
  cairo_set_source_surface(cairo_, surface, 0, 0);
  cairo_paint(cairo_);
  cairo_surface_destroy(surface);
}

void Canvas::fill(double lo_x, double lo_y, double hi_x, double hi_y, Rgba colour) {
  if (!isNear(Vector2d(lo_x, lo_y)) || !isNear(Vector2d(hi_x, hi_y))) return;
  const double x = std::round(lo_x), y = std::round(lo_y);
  cairo_rectangle(cairo_, x, y, std::round(hi_x) - x, std::round(hi_y) - y);
  setColour(cairo_, colour);
  cairo_fill(cairo_);
}

// Begins a line. Returns false if it has no place.
bool Canvas::trace(const std::vector<Vector2d>& points, double width, Rgba colour) {
  for (const Vector2d& p : points)
    if (!isNear(p)) return false;
  for (const Vector2d& p : points) cairo_line_to(cairo_, p.x(), p.y());
  cairo_set_line_width(cairo_, width);
  setColour(cairo_, colour);
  return true;
}

void Canvas::polyline(const std::vector<Vector2d>& points, double width, Rgba colour) {
  if (trace(points, width, colour)) cairo_stroke(cairo_);
}

void Canvas::line(const Vector2d& a, const Vector2d& b, double width, Rgba colour) { polyline({a, b}, width, colour); }

void Canvas::dashes(const Vector2d& a, const Vector2d& b, double width, Rgba colour, double on, double off) {
  const std::array<double, 2> lengths{on, off};
  if (!trace({a, b}, width, colour)) return;
  cairo_set_dash(cairo_, lengths.data(), 2, 0);
  cairo_stroke(cairo_);
  cairo_set_dash(cairo_, nullptr, 0, 0);
}

void Canvas::disc(const Vector2d& centre, double radius, Rgba colour) {
  if (!isNear(centre)) return;
  cairo_arc(cairo_, centre.x(), centre.y(), radius, 0, 2 * M_PI);
  setColour(cairo_, colour);
  cairo_fill(cairo_);
}

void Canvas::taper(const Vector2d& a, double radius_a, const Vector2d& b, double radius_b, Rgba colour) {
  constexpr double kEven_px = 0.5;
  if (std::abs(radius_a - radius_b) <= kEven_px) {
    cairo_set_line_cap(cairo_, CAIRO_LINE_CAP_ROUND);
    line(a, b, radius_a + radius_b, colour);
    return;
  }
  if (!isNear(a) || !isNear(b)) return;
  const Vector2d way = b - a;
  const double length = way.norm();
  if (length > std::abs(radius_a - radius_b)) {  // the outer tangents of both ends
    const double sine = (radius_a - radius_b) / length, cosine = std::sqrt(1 - sine * sine);
    const Vector2d along = way / length, across(-along.y(), along.x());
    const Vector2d one = sine * along + cosine * across, other = sine * along - cosine * across;
    for (const Vector2d& p : {Vector2d(a + radius_a * one), Vector2d(b + radius_b * one),
                              Vector2d(b + radius_b * other), Vector2d(a + radius_a * other)})
      cairo_line_to(cairo_, p.x(), p.y());
    cairo_close_path(cairo_);
    setColour(cairo_, colour);
    cairo_fill(cairo_);
  }
  disc(a, radius_a, colour);
  disc(b, radius_b, colour);
}

double Canvas::textWidth(std::string_view utf8, double height) {
  cairo_text_extents_t extents;
  cairo_set_font_size(cairo_, height / kCapitalPart);
  cairo_text_extents(cairo_, escaped(utf8).c_str(), &extents);
  return extents.x_advance;
}

void Canvas::text(std::string_view utf8, const Vector2d& at, double height, Rgba colour, Align align, bool turned) {
  if (!isNear(at)) return;
  const double part = align == Align::left ? 0 : align == Align::centre ? 0.5 : 1;
  cairo_save(cairo_);
  cairo_translate(cairo_, at.x(), at.y());
  if (turned) cairo_rotate(cairo_, -M_PI / 2);
  cairo_move_to(cairo_, -part * textWidth(utf8, height), 0);
  setColour(cairo_, colour);
  cairo_show_text(cairo_, escaped(utf8).c_str());
  cairo_restore(cairo_);
  cairo_new_path(cairo_);
}

}  // namespace filiform::tools
