#include "viewer/scene/minimap.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace filiform {

Minimap::Minimap(const Vector3d& lo_W, const Vector3d& hi_W, double width, double height)
    : middle_W_((lo_W + hi_W) / 2), middle_x_(width / 2), middle_y_(height / 2) {
  const Vector3d size = (hi_W - lo_W).cwiseMax(1.0);
  px_um_ = std::min(width / size.x(), height / size.y());
}

Minimap::Box Minimap::box(const Vector3d& centre_W, double side_um, double least_px) const {
  const double half = std::max(side_um * px_um_, least_px) / 2;
  return {x(centre_W) - half, y(centre_W) - half, x(centre_W) + half, y(centre_W) + half};
}

Vector3d Minimap::toWorld(double px, double py, double z_um) const {
  return {middle_W_.x() + (px - middle_x_) / px_um_, middle_W_.y() - (py - middle_y_) / px_um_, z_um};
}

Minimap Minimap::around(const Vector3d& centre_W, double side_um, double width, double height) const {
  const Vector3d half = Vector3d::Constant(5 * side_um);
  return {centre_W - half, centre_W + half, width, height};
}

ScaleBar scaleBar(double um_px, double most_px) {
  const double most_um = um_px * most_px;
  const double power = std::pow(10, std::floor(std::log10(most_um)));
  double length_um = power;
  for (const double factor : {2.0, 5.0})
    if (factor * power <= most_um) length_um = factor * power;
  char text[48];
  const auto write = [&](double value, const char* unit) { std::snprintf(text, sizeof text, "%g %s", value, unit); };
  if (length_um >= 1000)
    write(length_um / 1000, "mm");
  else if (length_um >= 1)
    write(length_um, "um");
  else
    write(length_um * 1000, "nm");
  return {length_um, length_um / um_px, text};
}

}  // namespace filiform
