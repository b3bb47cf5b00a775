// Probes for walks of a proxy, and exact comparison of places.
#pragma once

#include "solver/graph/graph_view.h"
#include "tests/support/scenes/paper_oracle.h"
#include "tests/support/scenes/test_graph.h"

#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace filiform::test {

// Compares all members except the tile, to the last bit; reports the first difference.
testing::AssertionResult samePlace(const ProxyPlace& a, const ProxyPlace& b);

// A hand that moves smoothly through the neighbourhood of the structure, from one node to another.
std::vector<Vector3d> smoothProbes(const WholeGraph& graph, std::mt19937_64& random, int ticks);
// Probes that jump at each tick: near and far, on nodes and elsewhere.
std::vector<Vector3d> jumpingProbes(const WholeGraph& graph, std::mt19937_64& random, int ticks);

// A place on a random segment of the graph: at t uniform in 0..1, or at one of its ends.
struct RandomStart {
  SegmentId segment;
  double t;
};
RandomStart randomStart(const WholeGraph& graph, std::mt19937_64& random);

inline GraphView viewOf(const TiledGraph& tiled, const TestGraph& graph) {
  return GraphView(tiled.table(), tiled.leaves(), graph.grid);
}

// Parameters with which a force-based proxy escapes often.
SolverParameters livelyParameters(std::uint32_t max_visited);

}  // namespace filiform::test
