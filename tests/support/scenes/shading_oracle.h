// A literal transcription of force shading (solver/proxy/force_shading.h): lists and sorting over a whole graph in
// memory, without bounds, and the literal basic solver. Shares only closestPoint() with the product's solver.
#pragma once

#include "tests/support/scenes/paper_oracle.h"

namespace filiform::test {

class ShadingOracle {
 public:
  // The graph must outlive the oracle.
  explicit ShadingOracle(const WholeGraph& graph) : graph_(graph), descent_(graph, SolverMethod::basic, {}) {}

  ProxyPlace place() const { return descent_.place(); }  // has no tile
  void setPlace(const ProxyPlace& place) { descent_.setPlace(place); }
  // Returns the number of segments tested.
  std::uint32_t advance(const Vector3d& h_W);

 private:
  Vector3d direction(std::uint32_t segment, bool at_parent, const Vector3d& h_W) const;
  Vector3d childOf(std::uint32_t segment) const { return graph_.nodes()[graph_.segments()[segment].child].p_W; }
  Vector3d parentOf(std::uint32_t segment) const { return graph_.nodes()[graph_.segments()[segment].parent].p_W; }

  const WholeGraph& graph_;
  PaperOracle descent_;
};

}  // namespace filiform::test
