#include "index/input/internal/soma_link.h"

namespace filiform::internal {

SomaSphere sphereOfContour(std::span<const Vector3d> contour) {
  SomaSphere sphere;
  const double share = 1 / static_cast<double>(contour.size());
  for (const Vector3d& point : contour) sphere.centre += share * point;
  for (const Vector3d& point : contour) sphere.radius += share * (point - sphere.centre).norm();
  return sphere;
}

std::optional<std::size_t> nearestSoma(const std::vector<SomaSphere>& somata, const Vector3d& point) {
  if (somata.empty() || somata.size() > kMostSomata) return std::nullopt;
  const auto distance = [&](const SomaSphere& soma) { return (point - soma.centre).norm() - soma.radius; };
  std::size_t nearest = 0;
  for (std::size_t i = 1; i < somata.size(); ++i)
    if (distance(somata[i]) < distance(somata[nearest])) nearest = i;
  return nearest;
}

}  // namespace filiform::internal
