#include "index/formats/internal/soma_link.h"

#include "index/cell/soma.h"

#include <algorithm>

namespace filiform::internal {

SomaSphere sphereOfContour(std::span<const Vector3d> contour) {
  SomaSphere sphere;
  const double share = 1 / static_cast<double>(contour.size());
  for (const Vector3d& point : contour) sphere.centre += share * point;
  for (const Vector3d& point : contour) sphere.radius += share * (point - sphere.centre).norm();
  return sphere;
}

void SomaLinks::soma(std::int64_t id, const SomaSphere& sphere, double point_radius, std::uint64_t line) {
  const double radius = sphere.radius == 0 ? point_radius : sphere.radius;
  if (graph_.node(id, sphere.centre, radius, kSomaType, line, "soma")) somata_.emplace_back(id, sphere);
}

void SomaLinks::link(std::int64_t id, const Vector3d& point, std::uint64_t line) {
  if (!links_ || somata_.empty() || somata_.size() > kMostSomata) return;
  const auto distance = [&](const auto& soma) { return (point - soma.second.centre).norm() - soma.second.radius; };
  const auto nearest = std::min_element(somata_.begin(), somata_.end(),
                                        [&](const auto& a, const auto& b) { return distance(a) < distance(b); });
  graph_.remark(InputCode::SOMA_LINK, line, {});
  graph_.link(nearest->first, id, line);
}

}  // namespace filiform::internal
