// Somata of formats that store them as contours, without a link to the neurites.
//
// A soma becomes one sample: a sphere at the centroid of its contour points. One link joins each root section to its
// soma; without these links a hand cannot cross the soma. They are the only geometry that a reader invents, so each is
// counted as SOMA_LINK, and SwcOptions::soma_links turns them off.
#pragma once

#include "index/formats/internal/graph_builder.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace filiform::internal {

struct SomaSphere {
  Vector3d centre = Vector3d::Zero();
  double radius = 0;  // mean distance of the contour points from the centre; 0 for a single point
};

// Requires at least one point. O(points).
SomaSphere sphereOfContour(std::span<const Vector3d> contour);

// Adds the somata of one file to its graph, and the links to them. Thread rule: thread-compatible.
class SomaLinks {
 public:
  // With more somata, no link is made: the search would be slow, and the file holds something other than cells.
  static constexpr std::size_t kMostSomata = 4096;

  // `graph` must outlive this object. `links`: SwcOptions::soma_links.
  SomaLinks(GraphBuilder& graph, bool links) : graph_(graph), links_(links) {}

  // Adds a soma as a sample of type 1. `point_radius`: the radius if all points of the contour coincide. A soma that
  // the graph drops receives no links.
  void soma(std::int64_t id, const SomaSphere& sphere, double point_radius, std::uint64_t line);
  // Links the first point of a root section, a node of the graph, to the soma whose surface is nearest. No effect
  // without somata. Call it after the last soma. O(somata).
  void link(std::int64_t id, const Vector3d& point, std::uint64_t line);

 private:
  GraphBuilder& graph_;
  bool links_;
  std::vector<std::pair<std::int64_t, SomaSphere>> somata_;  // those in the graph
};

}  // namespace filiform::internal
