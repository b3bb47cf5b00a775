// The geometry of the minimap and of the scale bar. The minimap is a small front view of the world. Immutable values;
// pure functions.
#pragma once

#include "index/geometry/grid.h"

#include <string>

namespace filiform {

// The world's x points to the right and y up; z is ignored. Pixels count from the map's top left corner, y down.
class Minimap {
 public:
  struct Box {
    double left, top, right, bottom;
  };

  // Fits the world's box into the middle of width x height pixels and keeps its proportions. Each side counts as 1 um
  // at least.
  Minimap(const Vector3d& lo_W, const Vector3d& hi_W, double width, double height);

  double x(const Vector3d& p_W) const { return middle_x_ + (p_W.x() - middle_W_.x()) * px_um_; }
  double y(const Vector3d& p_W) const { return middle_y_ - (p_W.y() - middle_W_.y()) * px_um_; }
  double px_um() const { return px_um_; }
  // The square of a cube about a point, at least `least_px` wide so that it stays visible.
  Box box(const Vector3d& centre_W, double side_um, double least_px) const;
  Box box(const Vector3d& lo_W, const Vector3d& hi_W) const { return {x(lo_W), y(hi_W), x(hi_W), y(lo_W)}; }
  // The world position under a pixel, with the given z.
  Vector3d toWorld(double x, double y, double z_um) const;
  // The nested map: centred on a point, and ten times as wide as a cube of `side_um`.
  Minimap around(const Vector3d& centre_W, double side_um, double width, double height) const;

 private:
  Vector3d middle_W_;
  double middle_x_, middle_y_, px_um_;
};

struct ScaleBar {
  double length_um, length_px;
  std::string text;  // "20 um", "500 nm", "2 mm"
};
// The longest bar of 1, 2 or 5 times a power of ten, at most `most_px` long. Requires um_px > 0 and finite.
ScaleBar scaleBar(double um_px, double most_px);

}  // namespace filiform
