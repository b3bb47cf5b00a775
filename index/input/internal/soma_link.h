// Somata of formats that store them as contours, without a link to the neurites.
//
// A soma becomes one sample: a sphere at the centroid of its contour points. One link joins each root section to its
// soma; without these links a hand cannot cross the soma. They are the only geometry that a reader invents, so each is
// counted as SOMA_LINK, and SwcOptions::soma_links turns them off. Thread rule: values, pure functions.
#pragma once

#include "index/geometry/grid.h"

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace filiform::internal {

struct SomaSphere {
  Vector3d centre = Vector3d::Zero();
  double radius = 0;  // mean distance of the contour points from the centre; 0 for a single point
};

// Requires at least one point. O(points).
SomaSphere sphereOfContour(std::span<const Vector3d> contour);

// Index of the soma whose surface is nearest to `point`; nullopt without somata, or with more than kMostSomata: the
// search would then be slow, and the file holds something other than cells. O(somata).
inline constexpr std::size_t kMostSomata = 4096;
std::optional<std::size_t> nearestSoma(const std::vector<SomaSphere>& somata, const Vector3d& point);

}  // namespace filiform::internal
