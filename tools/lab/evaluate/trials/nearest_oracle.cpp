#include "tools/lab/evaluate/trials/nearest_oracle.h"

#include "index/geometry/closest_point.h"

namespace filiform::tools {

namespace {

class NearestOracle : public ProxySolver {
 public:
  explicit NearestOracle(TrialCell& cell) : cell_(cell) {}

  const ProxyPlace& place() const noexcept override { return place_; }
  void setPlace(const ProxyPlace& place) noexcept override {
    place_ = before_ = place;
    tree_ = place.valid() ? &cell_.tree(cell_.root(place.segment.segment)) : nullptr;
  }
  void advance(const GraphView&, const ProbeState& probe, SolverStep& step) noexcept override {
    const Vector3d& h_W = probe.h_W;
    step.clear();
    before_ = place_;
    if (tree_ == nullptr || !h_W.allFinite()) return;
    // The active segment is tested first: its point bounds the search.
    const std::uint32_t child = place_.segment.segment;
    const CellGraph& graph = cell_.graph();
    ClosestPoint best = closestPoint(graph.position_W(child), graph.position_W(graph.parents[child]), h_W);
    const double limit2 = best.squared_distance;
    std::uint32_t segment = child;
    const SegmentTree::Found found = tree_->nearest(h_W, limit2);
    if (found.segment != SegmentTree::kNone) {
      segment = found.segment;
      best = found.point;
    }
    step.visited = found.tested + 1;
    place_ = cell_.placeAt(segment, best.t, best.p_W);
  }
  void undo() noexcept override { place_ = before_; }

 private:
  TrialCell& cell_;
  const SegmentTree* tree_ = nullptr;
  ProxyPlace place_, before_;
};

}  // namespace

std::unique_ptr<ProxySolver> makeNearestOracle(TrialCell& cell) { return std::make_unique<NearestOracle>(cell); }

}  // namespace filiform::tools
