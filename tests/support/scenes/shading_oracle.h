// A literal transcription of force shading (solver/proxy/force_shading.h): lists and sorting over a whole graph in
// memory, without bounds. Shares only closestPoint() with the product's solver.
#pragma once

#include "tests/support/scenes/paper_oracle.h"

namespace filiform::test {

class ShadingOracle {
 public:
  // The graph must outlive the oracle.
  explicit ShadingOracle(const WholeGraph& graph) : graph_(graph) {}

  const ProxyPlace& place() const { return place_; }  // has no tile
  void setPlace(const ProxyPlace& place) { place_ = place; }
  // Returns the number of segments walked.
  std::uint32_t advance(const Vector3d& h_W);

 private:
  std::vector<std::uint32_t> othersByDistance(std::uint32_t node, std::uint32_t segment, const Vector3d& h_W) const;
  Vector3d direction(std::uint32_t segment, bool at_parent, const Vector3d& h_W) const;
  bool leave(std::uint32_t& segment, double& t, bool by_parent, const Vector3d& h_W) const;
  Vector3d childOf(std::uint32_t segment) const { return graph_.nodes()[graph_.segments()[segment].child].p_W; }
  Vector3d parentOf(std::uint32_t segment) const { return graph_.nodes()[graph_.segments()[segment].parent].p_W; }

  const WholeGraph& graph_;
  ProxyPlace place_;
};

}  // namespace filiform::test
