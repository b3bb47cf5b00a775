// Probes to walk a proxy with, and exact comparison of places.
#pragma once

#include "solver/graph/graph_view.h"
#include "tests/support/paper_oracle.h"
#include "tests/support/test_graph.h"

#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace filiform::test {

// Equal to the last bit in all but the tile; says where not.
testing::AssertionResult samePlace(const ProxyPlace& a, const ProxyPlace& b);

// A hand: moves smoothly through the neighbourhood of the structure, now towards one node of it, now towards another.
std::vector<Vector3d> smoothProbes(const WholeGraph& graph, std::mt19937_64& random, int ticks);
// Anywhere, near and far, on nodes and off, from one tick to the next.
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

// Parameters under which a force-based proxy escapes often.
SolverParameters livelyParameters(std::uint32_t max_visited);

}  // namespace filiform::test
