// packed() and unpacked() of neurites.h: records of fixed size, as narrow as the neurites allow. The bytes never leave
// the program.
#include "index/levels/internal/neurites.h"

#include <algorithm>
#include <cstring>
#include <limits>

namespace filiform {
namespace {

struct PackedHead {
  double error_um, pixel_um, hidden_um;
  std::uint64_t represented, hidden;
  GridPoint origin;  // the lowest position on each axis
  std::uint32_t paths, points, bytes_of_point;
};

struct PackedPath {  // its points come after those of the path before
  std::uint32_t cell, first_sample, last_sample, lowest;
  std::uint32_t count : 31, attached : 1;
};

template <typename Step, typename Small>
struct PackedPoint {
  Step p[3];  // from the origin
  Small type, segments;
  float radius_um;

  static bool holds(const NeuritePoint& point, const GridPoint& origin) {
    return (point.p - origin).maxCoeff() <= std::int64_t{std::numeric_limits<Step>::max()} &&
           std::max<std::uint32_t>(point.type, point.segments) <= std::numeric_limits<Small>::max();
  }
  static PackedPoint of(const NeuritePoint& point, const GridPoint& origin) {
    const GridPoint p = point.p - origin;
    return {{static_cast<Step>(p[0]), static_cast<Step>(p[1]), static_cast<Step>(p[2])},
            static_cast<Small>(point.type),
            static_cast<Small>(point.segments),
            point.radius_um};
  }
  NeuritePoint point(const GridPoint& origin) const {
    return {origin + GridPoint(p[0], p[1], p[2]), radius_um, type, segments};
  }
};

struct WidePoint {
  NeuritePoint whole;

  static WidePoint of(const NeuritePoint& point, const GridPoint&) { return {point}; }
  NeuritePoint point(const GridPoint&) const { return whole; }
};

using NarrowestPoint = PackedPoint<std::uint16_t, std::uint8_t>;
using NarrowPoint = PackedPoint<std::uint32_t, std::uint16_t>;

template <typename Point>
bool holdsAll(const Neurites& all, const GridPoint& origin) {
  return std::all_of(all.points.begin(), all.points.end(),
                     [&](const NeuritePoint& point) { return Point::holds(point, origin); });
}

template <typename T>
void putRaw(std::uint8_t*& to, const T& value) {
  std::memcpy(to, static_cast<const void*>(&value), sizeof value);
  to += sizeof value;
}

template <typename T>
void getRaw(const std::uint8_t*& from, T& value) {
  std::memcpy(static_cast<void*>(&value), from, sizeof value);
  from += sizeof value;
}

template <typename Point>
std::vector<std::uint8_t> packedAs(const Neurites& all, PackedHead head) {
  head.bytes_of_point = sizeof(Point);
  std::vector<std::uint8_t> bytes(sizeof head + head.paths * sizeof(PackedPath) + head.points * sizeof(Point));
  std::uint8_t* to = bytes.data();
  putRaw(to, head);
  for (const NeuritePath& path : all.paths)
    putRaw(to, PackedPath{path.cell, path.first_sample, path.last_sample, path.lowest, path.count,
                          path.attached ? 1u : 0u});
  for (const NeuritePath& path : all.paths)
    for (std::uint32_t k = 0; k < path.count; ++k) putRaw(to, Point::of(all.points[path.begin + k], head.origin));
  return bytes;
}

template <typename Point>
void unpackPoints(const std::uint8_t* from, const GridPoint& origin, std::vector<NeuritePoint>& points) {
  for (NeuritePoint& point : points) {
    Point packed;
    getRaw(from, packed);
    point = packed.point(origin);
  }
}

}  // namespace

std::vector<std::uint8_t> packed(const Neurites& all) {
  PackedHead head{all.error_um,
                  all.pixel_um,
                  all.hidden_um,
                  all.represented,
                  all.hidden,
                  GridPoint::Zero(),
                  static_cast<std::uint32_t>(all.paths.size()),
                  static_cast<std::uint32_t>(all.points.size()),
                  0};
  if (!all.points.empty()) head.origin = all.points.front().p;
  for (const NeuritePoint& point : all.points) head.origin = head.origin.cwiseMin(point.p);
  if (holdsAll<NarrowestPoint>(all, head.origin)) return packedAs<NarrowestPoint>(all, head);
  if (holdsAll<NarrowPoint>(all, head.origin)) return packedAs<NarrowPoint>(all, head);
  return packedAs<WidePoint>(all, head);
}

Neurites unpacked(std::span<const std::uint8_t> bytes) {
  const std::uint8_t* from = bytes.data();
  PackedHead head;
  getRaw(from, head);
  Neurites all;
  all.error_um = head.error_um;
  all.pixel_um = head.pixel_um;
  all.hidden_um = head.hidden_um;
  all.represented = head.represented;
  all.hidden = head.hidden;
  all.paths.resize(head.paths);
  std::uint32_t begin = 0;
  for (NeuritePath& path : all.paths) {
    PackedPath packed;
    getRaw(from, packed);
    path = {packed.cell, packed.first_sample, packed.last_sample,  packed.lowest,
            begin,       packed.count,        packed.attached != 0};
    begin += packed.count;
  }
  all.points.resize(head.points);
  if (head.bytes_of_point == sizeof(NarrowestPoint))
    unpackPoints<NarrowestPoint>(from, head.origin, all.points);
  else if (head.bytes_of_point == sizeof(NarrowPoint))
    unpackPoints<NarrowPoint>(from, head.origin, all.points);
  else
    unpackPoints<WidePoint>(from, head.origin, all.points);
  return all;
}

}  // namespace filiform
