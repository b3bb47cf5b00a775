// A literal transcription of bounded climb (solver/proxy/bounded_climb.h): maps, sets and a priority queue over a whole
// graph in memory, without a work cap. Shares only closestPoint() with the product's solver.
#pragma once

#include "tests/support/scenes/paper_oracle.h"

namespace filiform::test {

class ClimbOracle {
 public:
  // The graph must outlive the oracle.
  ClimbOracle(const WholeGraph& graph, const ClimbParameters& parameters) : graph_(graph), parameters_(parameters) {}

  const ProxyPlace& place() const { return place_; }  // has no tile
  void setPlace(const ProxyPlace& place);
  // Returns the number of segments tested.
  std::uint32_t advance(const ProbeState& probe);

  double budget_um() const { return budget_um_; }    // of the last tick
  double climbed_um() const { return climbed_um_; }  // climb on the way to the place of the last tick
  double patience_mm() const { return patience_mm_; }

 private:
  const WholeGraph& graph_;
  ClimbParameters parameters_;
  ProxyPlace place_;
  double patience_mm_ = 0, budget_um_ = 0, climbed_um_ = 0;
  Vector3d last_W_ = Vector3d::Zero();
};

}  // namespace filiform::test
