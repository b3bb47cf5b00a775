// The front view of tools/drawing/report.h.
#include "index/errors.h"
#include "tools/drawing/report.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace filiform::tools {

namespace {

constexpr double kHeader_px = 88, kFooter_px = 56, kSide_px = 44;
constexpr Colour kPath{213, 60, 0};

// Muted colours of nearly equal lightness, none near the colour of the path.
Colour cellColour(std::uint64_t cell) {
  static constexpr std::array<Colour, 12> kColours{{{74, 111, 165},
                                                    {84, 140, 120},
                                                    {120, 104, 160},
                                                    {98, 146, 172},
                                                    {136, 142, 84},
                                                    {152, 106, 138},
                                                    {64, 128, 140},
                                                    {112, 122, 134},
                                                    {98, 134, 92},
                                                    {92, 92, 148},
                                                    {150, 128, 92},
                                                    {124, 112, 112}}};
  // Neighbouring numbers get distant colours.
  return kColours[(cell * 0x9e3779b97f4a7c15U >> 32) % kColours.size()];
}

std::string lengthLabel(double um) {
  if (um >= 1000) return tickLabel(um / 1000, um / 1000) + " mm";
  if (um < 0.1) return tickLabel(um * 1000, um * 1000) + " nm";
  return tickLabel(um, um) + " µm";
}

}  // namespace

std::vector<ProjectionLevel> syntheticLevels() {
  return {{1400, "pia", true},     {1270, "L1 / L2", false}, {1150, "L2 / L3", false}, {980, "L3 / L4", false},
          {800, "L4 / L5", false}, {450, "L5 / L6", false},  {0, "white matter", true}};
}

ProjectionPicture::ProjectionPicture(const ProjectionOptions& options) : options_(options) {
  // The pia or the white matter is shown if it is near the picture's content.
  const double near_um = (options.hi_um.y() - options.lo_um.y()) * 0.1;
  for (const ProjectionLevel& level : options.levels) {
    if (!level.strong) continue;
    if (level.y_um > options.hi_um.y() && level.y_um < options.hi_um.y() + near_um) options_.hi_um.y() = level.y_um;
    if (level.y_um < options.lo_um.y() && level.y_um > options.lo_um.y() - near_um) options_.lo_um.y() = level.y_um;
  }
  const Vector3d size_um = options_.hi_um - options_.lo_um;
  if (!size_um.allFinite() || size_um.minCoeff() < 0)
    throw UsageError("picture: the bounds of what it shows are empty or not finite");
  if (options.height < 200 || options.height > 8192)
    throw UsageError("picture: the height must be between 200 and 8192 pixels");
  const double view_px = options.height - kHeader_px - kFooter_px;
  const double across_um = std::max(size_um.x(), 1e-6);
  const double up_um = std::max(size_um.y(), 1e-6);
  scale_ = std::min(view_px / up_um, (2000 - 2 * kSide_px) / across_um);
  const int width = static_cast<int>(std::lround(std::clamp(across_um * scale_ + 2 * kSide_px, 500.0, 2000.0)));
  image_ = Image(width, options.height);
  top_ = static_cast<int>(kHeader_px);
  bottom_ = options.height - static_cast<int>(kFooter_px);
  strength_.assign(static_cast<std::size_t>(width) * static_cast<std::size_t>(options.height), 0.0F);
}

Vector2d ProjectionPicture::project(const Vector3d& p_um) const {
  const Vector3d centre_um = (options_.lo_um + options_.hi_um) / 2;
  return {image_.width / 2.0 + (p_um.x() - centre_um.x()) * scale_,
          (top_ + bottom_) / 2.0 - (p_um.y() - centre_um.y()) * scale_};
}

// 0.35 at the back, 1 at the front.
double ProjectionPicture::nearness(double z_um) const {
  const double depth_um = options_.hi_um.z() - options_.lo_um.z();
  const double t = depth_um > 0 ? std::clamp((z_um - options_.lo_um.z()) / depth_um, 0.0, 1.0) : 1;
  return 0.35 + 0.65 * t;
}

void ProjectionPicture::put(const Vector2d& a, const Vector2d& b, double width, Colour colour, double near) {
  const double reach = width / 2 + 1;
  const auto pixel = [](double value, int hi) {
    return static_cast<int>(std::clamp(std::floor(value), 0.0, static_cast<double>(hi)));
  };
  const int x0 = pixel(std::min(a.x(), b.x()) - reach, image_.width);
  const int x1 = pixel(std::max(a.x(), b.x()) + reach + 1, image_.width);
  const int y0 = pixel(std::min(a.y(), b.y()) - reach, image_.height);
  const int y1 = pixel(std::max(a.y(), b.y()) + reach + 1, image_.height);
  const Vector2d ab = b - a;
  const double square = ab.squaredNorm();
  const double half = std::max(width, 1.0) / 2;
  const double most = std::min(width, 1.0) * near;
  for (int y = y0; y < y1; ++y) {
    for (int x = x0; x < x1; ++x) {
      const Vector2d p(x + 0.5, y + 0.5);
      const double t = square > 0 ? std::clamp((p - a).dot(ab) / square, 0.0, 1.0) : 0;
      const double coverage = std::clamp(half + 0.5 - (p - a - t * ab).norm(), 0.0, 1.0);
      const auto strength = static_cast<float>(coverage * most);
      const std::size_t i =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(image_.width) + static_cast<std::size_t>(x);
      // The strongest segment wins instead of blending, so that joints stay as they are and the order does not matter.
      if (strength <= strength_[i]) continue;
      strength_[i] = strength;
      const Colour shown = mix(kWhite, colour, static_cast<double>(strength));
      image_.rgb[i * 3] = shown.r;
      image_.rgb[i * 3 + 1] = shown.g;
      image_.rgb[i * 3 + 2] = shown.b;
    }
  }
}

void ProjectionPicture::addSegment(std::uint64_t cell, const Vector3d& a_um, const Vector3d& b_um, std::uint16_t type,
                                   double radius_um) {
  if (!a_um.allFinite() || !b_um.allFinite()) return;
  const double near = nearness((a_um.z() + b_um.z()) / 2);
  const bool axon = type == 2;
  const double thickness = radius_um > 0 ? 2 * radius_um * scale_ : 0;
  const double width = std::clamp(thickness, axon ? 0.7 : 1.0, 12.0);
  const Colour colour = cellColour(cell);
  put(project(a_um), project(b_um), width, axon ? mix(colour, kWhite, 0.3) : colour, near);
}

void ProjectionPicture::addSoma(std::uint64_t cell, const Vector3d& centre_um, double radius_um) {
  if (!centre_um.allFinite()) return;
  const double radius = std::clamp(radius_um > 0 ? radius_um * scale_ : 0, 3.0, 40.0);
  somata_.push_back({project(centre_um), radius, nearness(centre_um.z()), mix(cellColour(cell), {20, 20, 30}, 0.25)});
}

void ProjectionPicture::addPath(const std::vector<Vector3d>& path_um) {
  std::vector<Vector2d> run;
  for (const Vector3d& p : path_um) {
    if (p.allFinite()) {
      const Vector2d at = project(p);
      // A path of millions of ticks moves only a fraction of a pixel a tick.
      if (run.empty() || (at - run.back()).norm() > 0.3) run.push_back(at);
    } else if (!run.empty()) {
      paths_.push_back(std::exchange(run, {}));
    }
  }
  if (!run.empty()) paths_.push_back(std::move(run));
}

Image ProjectionPicture::finish() {
  std::stable_sort(somata_.begin(), somata_.end(), [](const Soma& a, const Soma& b) { return a.near < b.near; });
  Canvas canvas(image_);
  for (const Soma& soma : somata_) {
    canvas.disc(soma.centre, soma.radius + 1, kWhite, 0.8);
    canvas.disc(soma.centre, soma.radius, mix(kWhite, soma.colour, 0.35 + 0.65 * soma.near));
  }
  const double right = image_.width - 12.0;
  for (const ProjectionLevel& level : options_.levels) {
    const double y = std::floor(project({0, level.y_um, 0}).y()) + 0.5;
    if (y < top_ - 8 || y > bottom_ + 8) continue;
    if (level.strong) {
      canvas.line({12, y}, {right, y}, 1.4, {90, 90, 96});
    } else {
      canvas.dashes({12, y}, {right, y}, 1, {176, 176, 184}, 3, 5);
    }
    const double width = Canvas::textWidth(level.label, 8.5);
    canvas.fill(10, y - 15, 18 + width, y - 2, kWhite, 0.75);
    canvas.text(level.label, {14, y - 5}, 8.5, level.strong ? kInk : kGrey);
  }
  for (const auto& path : paths_) canvas.polyline(path, 6, kWhite, 0.75);
  for (const auto& path : paths_) canvas.polyline(path, 2.8, kPath);
  if (!paths_.empty()) {
    const Vector2d start = paths_.front().front();
    canvas.disc(start, 8, kWhite, 0.9);
    canvas.disc(start, 6.5, kPath);
    canvas.disc(start, 3.5, kWhite);
    const auto& last = paths_.back();
    const Vector2d end = last.back();
    // The direction over the last ten pixels: a single tick is too short.
    Vector2d direction(0, 0);
    for (std::size_t i = last.size(); i-- > 0 && direction.norm() < 10;) direction = end - last[i];
    if (direction.norm() > 1e-9) {
      direction.normalize();
      const Vector2d side(-direction.y(), direction.x());
      canvas.polyline({end - 11 * direction + 6.5 * side, end + 2 * direction, end - 11 * direction - 6.5 * side}, 3,
                      kPath);
    }
  }

  canvas.text(options_.title, {16, 27}, 12, kInk);
  canvas.text(options_.subtitle, {16, 48}, 8.5, kGrey);

  // The longest round length within a quarter of the picture's width.
  const double most_um = image_.width * 0.25 / scale_;
  const double power = std::pow(10.0, std::floor(std::log10(most_um)));
  double bar_um = power;
  for (const double factor : {2.0, 5.0})
    if (factor * power <= most_um) bar_um = factor * power;
  const double bar_px = bar_um * scale_;
  const double y = options_.height - 30.0;
  const double x = image_.width - 24 - bar_px;
  canvas.fill(x, y, x + bar_px, y + 4, kInk);
  canvas.text(lengthLabel(bar_um), {x + bar_px / 2, y + 20}, 9.5, kInk, Align::centre);
  double legend = 16;
  if (!paths_.empty()) {
    canvas.line({legend, y + 4}, {legend + 30, y + 4}, 2.8, kPath);
    canvas.text("way of the proxy", {legend + 40, y + 8}, 8.5, kInk);
  }
  return std::move(image_);
}

}  // namespace filiform::tools
