// Steps along the neurites of one cell, for users who travel by keys: to the next fork, the parent, a tip or the root;
// and path lengths. Thread rule: immutable after construction.
#pragma once

#include "index/set/cell_graph.h"
#include "solver/proxy/proxy_solver.h"

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

namespace filiform {

class CellWalk {
 public:
  // A position on the cell: on a segment between two samples (ranks), or at a sample.
  struct Spot {
    std::uint32_t segment = 0;            // rank
    double t = 0;                         // 0 child .. 1 parent
    std::uint32_t child = 0, parent = 0;  // ranks; equal for an isolated sample
  };

  // For a cell with loops, parents are those of its spanning forest, while paths may use every link. Samples that only
  // give a soma its shape are neither children nor tips; from a place on such a sample, parent() still leads to the
  // soma's root. O(samples).
  explicit CellWalk(CellGraph graph);

  const CellGraph& graph() const { return graph_; }
  std::uint32_t samples() const { return static_cast<std::uint32_t>(graph_.samples()); }

  // Nullopt if the place is not on a segment of this cell. O(1).
  std::optional<Spot> spotOf(const ProxyPlace& place) const;
  // The position of a sample, on a segment that ends there. Requires node < samples(). O(1).
  Spot at(std::uint32_t node) const;
  Vector3d position_W(const Spot& spot) const;

  // Ranks of samples; nullopt if there is none. `turn` selects one of the children of a fork and wraps around. The
  // child with the longest neurites behind it is first.
  std::optional<std::uint32_t> parent(const Spot& spot) const;
  std::optional<std::uint32_t> child(const Spot& spot, std::uint32_t turn = 0) const;
  // The next sample that is a fork or a tip; on the way back, a fork or the root.
  std::optional<std::uint32_t> nextBranch(const Spot& spot, std::uint32_t turn = 0) const;
  std::optional<std::uint32_t> previousBranch(const Spot& spot) const;
  // Goes back to the last fork, then returns the fork's next child after the one that leads to this position. Nullopt
  // if there is no fork behind.
  std::optional<std::uint32_t> otherBranch(const Spot& spot) const;
  std::uint32_t root(const Spot& spot) const;
  // The tips of the position's tree, nearest along the path first, at most `most`, without the position itself.
  // O(samples log samples).
  std::vector<std::uint32_t> tips(const Spot& spot, std::size_t most) const;
  // The tip that is farthest along the path. O(samples log samples).
  std::optional<std::uint32_t> farthestTip(const Spot& spot) const;

  // The length of the shortest path; nullopt if no path joins a and b. O(samples log samples).
  std::optional<double> pathLength_um(const Spot& a, const Spot& b) const;
  // The samples on the path from a to b, beginning with an end of a's segment; empty if no path joins a and b.
  std::vector<std::uint32_t> path(const Spot& a, const Spot& b) const;

 private:
  struct Reached {
    std::vector<double> length_um;      // path length by sample; infinite: not reached
    std::vector<std::uint32_t> before;  // the sample before each sample on its path
  };
  Reached reach(const Spot& from) const;
  std::optional<double> lengthTo(const Reached& reached, const Spot& from, const Spot& to,
                                 std::uint32_t* by = nullptr) const;
  double distance(std::uint32_t a, std::uint32_t b) const {
    return (graph_.position_W(a) - graph_.position_W(b)).norm();
  }
  bool isTip(std::uint32_t node) const;

  CellGraph graph_;
  std::vector<bool> is_soma_end_;                      // by sample; see Soma::dead_ends
  std::vector<std::uint32_t> parents_, segment_at_;    // by sample; segment_at_: a segment that ends at the sample
  std::vector<std::uint32_t> first_child_, children_;  // children of n: children_[first_child_[n] .. first_child_[n+1])
  std::vector<std::uint32_t> first_neighbour_, neighbours_;
};

}  // namespace filiform
