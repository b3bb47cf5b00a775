// The geometry of the minimap and the scale bar: where things of the world lie on a small map seen from the front.
// Immutable values; pure functions.
#pragma once

#include "index/geometry/grid.h"

#include <string>

namespace filiform {

// x to the right, y up on the screen; z is not shown. Pixels from the map's top left corner, y down.
class Minimap {
 public:
  struct Box {
    double left, top, right, bottom;
  };

  // The world's box fitted into so many pixels, its proportions kept, in the middle. Boxes without extent have a um.
  Minimap(const Vector3d& lo_W, const Vector3d& hi_W, double width, double height);

  double x(const Vector3d& p_W) const { return middle_x_ + (p_W.x() - middle_W_.x()) * px_um_; }
  double y(const Vector3d& p_W) const { return middle_y_ - (p_W.y() - middle_W_.y()) * px_um_; }
  double px_um() const { return px_um_; }
  // Of a cube about a point; never smaller than `least_px` across, so that it stays to be seen.
  Box box(const Vector3d& centre_W, double side_um, double least_px) const;
  Box box(const Vector3d& lo_W, const Vector3d& hi_W) const { return {x(lo_W), y(hi_W), x(hi_W), y(lo_W)}; }
  // What lies under a pixel, in the plane of that z.
  Vector3d toWorld(double x, double y, double z_um) const;
  // The map about the point at which a cube of `side_um` takes a tenth of it: the nested map.
  Minimap around(const Vector3d& centre_W, double side_um, double width, double height) const;

 private:
  Vector3d middle_W_;
  double middle_x_, middle_y_, px_um_;
};

struct ScaleBar {
  double length_um, length_px;
  std::string text;  // "20 um", "500 nm", "2 mm"
};
// The longest bar of 1, 2 or 5 times a power of ten that takes at most `most_px`. Requires um_px > 0 and finite.
ScaleBar scaleBar(double um_px, double most_px);

}  // namespace filiform
