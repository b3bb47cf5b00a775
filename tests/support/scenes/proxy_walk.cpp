#include "tests/support/scenes/proxy_walk.h"

#include <bit>

namespace filiform::test {

namespace {

bool equalBits(double a, double b) { return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b); }

Vector3d cube(std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const double x = unit(random), y = unit(random), z = unit(random);
  return {x, y, z};
}

const Vector3d& anyNode_W(const WholeGraph& graph, std::mt19937_64& random) {
  return graph.nodes()[random() % graph.nodes().size()].p_W;
}

}  // namespace

testing::AssertionResult samePlace(const ProxyPlace& a, const ProxyPlace& b) {
  const auto differ = [&](const char* what) {
    return testing::AssertionFailure() << what << " differs: segment " << a.segment.cell << "/" << a.segment.segment
                                       << " t " << a.t << " at (" << a.p_W.transpose() << ") and segment "
                                       << b.segment.cell << "/" << b.segment.segment << " t " << b.t << " at ("
                                       << b.p_W.transpose() << ")";
  };
  if (a.segment != b.segment) return differ("segment");
  if (!equalBits(a.t, b.t)) return differ("t");
  if (a.at_node != b.at_node || (a.at_node && a.node != b.node)) return differ("node");
  for (int axis = 0; axis < 3; ++axis)
    if (!equalBits(a.p_W[axis], b.p_W[axis])) return differ("position");
  return testing::AssertionSuccess();
}

std::vector<Vector3d> smoothProbes(const WholeGraph& graph, std::mt19937_64& random, int ticks) {
  std::vector<Vector3d> probes;
  Vector3d h_W = anyNode_W(graph, random) + cube(random), aim_W = h_W, velocity = Vector3d::Zero();
  for (int i = 0; i < ticks; ++i) {
    if (i % 15 == 0) aim_W = anyNode_W(graph, random) + 0.5 * cube(random);
    velocity = 0.7 * velocity + 0.08 * (aim_W - h_W) + 0.02 * cube(random);
    h_W += velocity;
    probes.push_back(h_W);
  }
  return probes;
}

std::vector<Vector3d> jumpingProbes(const WholeGraph& graph, std::mt19937_64& random, int ticks) {
  std::vector<Vector3d> probes;
  for (int i = 0; i < ticks; ++i) {
    const double reach_um[] = {0.0, 0.1, 3.0, 30.0, 1e4, 1e6};
    probes.push_back(anyNode_W(graph, random) + reach_um[random() % 6] * cube(random));
  }
  return probes;
}

RandomStart randomStart(const WholeGraph& graph, std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const double choices[] = {0.0, 1.0, unit(random), unit(random)};
  return {graph.segments()[random() % graph.segments().size()].id, choices[random() % 4]};
}

SolverParameters livelyParameters(std::uint32_t max_visited) {
  SolverParameters parameters;
  parameters.max_visited = max_visited;
  parameters.gain = 1.0;
  parameters.r_min_um = 0.2;
  parameters.r_max_um = 3.0;
  return parameters;
}

}  // namespace filiform::test
