#include "solver/descent.h"

#include "solver/internal/bounded_search.h"

namespace filiform {

namespace {

class Descent final : public internal::BoundedSearch {
 public:
  using BoundedSearch::BoundedSearch;

 private:
  void follow(Tick& tick, const Tested& tested) noexcept override {
    if (tested.q.t == 0.0) goOn(tick, tested.tile, tested.child, tested.sub_goal_W);
    if (tested.q.t == 1.0) goOn(tick, tested.tile, tested.parent, tested.sub_goal_W);
  }
};

}  // namespace

std::unique_ptr<ProxySolver> makeDescent(const SolverParameters& parameters) {
  return std::make_unique<Descent>(parameters.max_visited);
}

}  // namespace filiform
