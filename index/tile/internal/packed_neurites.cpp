// packed() and unpacked() of neurites.h: records of fixed size, as memory holds them. The bytes never leave the
// program.
#include "index/tile/internal/neurites.h"

#include <algorithm>
#include <cstring>
#include <limits>

namespace filiform {
namespace {

struct PackedHead {
  double error_um, pixel_um, hidden_um;
  std::uint64_t represented, hidden;
  GridPoint origin;
  std::uint32_t paths, points;
  bool narrow;
};

struct NarrowPoint {
  std::int32_t p[3];  // from the origin
  float radius_um;
  std::uint16_t type, segments;
};

bool fitsNarrow(const Neurites& all, const GridPoint& origin) {
  constexpr std::int64_t kMostStep = std::numeric_limits<std::int32_t>::max();
  return std::all_of(all.points.begin(), all.points.end(), [&](const NeuritePoint& point) {
    return (point.p - origin).cwiseAbs().maxCoeff() <= kMostStep && point.segments <= UINT16_MAX;
  });
}

template <typename T>
void copyTo(std::uint8_t*& to, const T* from, std::size_t count) {
  if (count > 0) std::memcpy(to, from, count * sizeof(T));
  to += count * sizeof(T);
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
                  false};
  if (!all.points.empty()) head.origin = all.points.front().p;
  head.narrow = fitsNarrow(all, head.origin);
  const std::size_t point_bytes = head.narrow ? sizeof(NarrowPoint) : sizeof(NeuritePoint);
  std::vector<std::uint8_t> bytes(sizeof head + all.paths.size() * sizeof(NeuritePath) +
                                  all.points.size() * point_bytes);
  std::uint8_t* to = bytes.data();
  copyTo(to, &head, 1);
  copyTo(to, all.paths.data(), all.paths.size());
  if (!head.narrow) {
    copyTo(to, all.points.data(), all.points.size());
    return bytes;
  }
  for (const NeuritePoint& point : all.points) {
    const Eigen::Vector3i p = (point.p - head.origin).cast<std::int32_t>();
    const NarrowPoint narrow{
        {p.x(), p.y(), p.z()}, point.radius_um, point.type, static_cast<std::uint16_t>(point.segments)};
    copyTo(to, &narrow, 1);
  }
  return bytes;
}

Neurites unpacked(std::span<const std::uint8_t> bytes) {
  PackedHead head;
  const std::uint8_t* from = bytes.data();
  std::memcpy(static_cast<void*>(&head), from, sizeof head);
  from += sizeof head;
  Neurites all;
  all.error_um = head.error_um;
  all.pixel_um = head.pixel_um;
  all.hidden_um = head.hidden_um;
  all.represented = head.represented;
  all.hidden = head.hidden;
  all.paths.resize(head.paths);
  all.points.resize(head.points);
  if (head.paths > 0) std::memcpy(all.paths.data(), from, head.paths * sizeof(NeuritePath));
  from += head.paths * sizeof(NeuritePath);
  if (!head.narrow) {
    if (head.points > 0) std::memcpy(static_cast<void*>(all.points.data()), from, head.points * sizeof(NeuritePoint));
    return all;
  }
  for (NeuritePoint& point : all.points) {
    NarrowPoint narrow;
    std::memcpy(&narrow, from, sizeof narrow);
    from += sizeof narrow;
    point = {head.origin + GridPoint(narrow.p[0], narrow.p[1], narrow.p[2]), narrow.radius_um, narrow.type,
             narrow.segments};
  }
  return all;
}

}  // namespace filiform
