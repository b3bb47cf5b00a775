#include "solver/force_based.h"

#include "solver/internal/bounded_search.h"

#include <algorithm>
#include <cmath>

namespace filiform {

namespace {

class ForceBased final : public internal::BoundedSearch {
 public:
  explicit ForceBased(const SolverParameters& parameters)
      : BoundedSearch(parameters.max_visited),
        gain_(parameters.gain),
        r_min_um_(parameters.r_min_um),
        r_max_um_(parameters.r_max_um) {}

 private:
  void follow(Tick& tick, const Tested& tested) noexcept override {
    const ClosestPoint& q = tested.q;
    // The sub-goal is kept as a point: its distance is that to the present h even when the sweep began under another
    // one.
    if (q.squared_distance > (tested.sub_goal_W - tick.h_W).squaredNorm()) return;
    if (q.t == 0.0) return goOn(tick, tested.tile, tested.child, q.p_W);
    if (q.t == 1.0) return goOn(tick, tested.tile, tested.parent, q.p_W);
    const double r_um = std::min(r_max_um_, gain_ * std::sqrt(q.squared_distance) + r_min_um_);
    if ((tested.parent_W - q.p_W).norm() < r_um) goOn(tick, tested.tile, tested.parent, q.p_W);
    if ((tested.child_W - q.p_W).norm() < r_um) goOn(tick, tested.tile, tested.child, q.p_W);
  }

  double gain_, r_min_um_, r_max_um_;
};

}  // namespace

std::unique_ptr<ProxySolver> makeForceBased(const SolverParameters& parameters) {
  return std::make_unique<ForceBased>(parameters);
}

}  // namespace filiform
