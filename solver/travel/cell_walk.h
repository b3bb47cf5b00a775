// Steps along a cell's own threads, for a person who travels by keys: to the next fork, the parent, a tip, the root;
// and how far it is along the path. Immutable after construction.
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
  // Where on the cell: between two samples (ranks), or at one of them.
  struct Spot {
    std::uint32_t segment = 0;            // rank
    double t = 0;                         // 0 child .. 1 parent
    std::uint32_t child = 0, parent = 0;  // ranks; the same for an isolated sample
  };

  // Of a cell with loops, parents are those of its spanning forest; paths may use every link. Samples that only give a
  // soma its shape are neither children nor tips; a place on one of them still leads back to the soma's root.
  // O(samples).
  explicit CellWalk(CellGraph graph);

  const CellGraph& graph() const { return graph_; }
  std::uint32_t samples() const { return static_cast<std::uint32_t>(graph_.samples()); }

  // None where the place is on no segment of this cell. O(1).
  std::optional<Spot> spotOf(const ProxyPlace& place) const;
  // At a sample; a segment that ends there. Requires node < samples(). O(1).
  Spot at(std::uint32_t node) const;
  Vector3d position_W(const Spot& spot) const;

  // Samples (ranks); none where there is no such thing. `turn` chooses among a fork's children, those with the longest
  // threads behind them first, and wraps around.
  std::optional<std::uint32_t> parent(const Spot& spot) const;
  std::optional<std::uint32_t> child(const Spot& spot, std::uint32_t turn = 0) const;
  // The next sample that is not just passed through: a fork, a tip, or the root on the way back.
  std::optional<std::uint32_t> nextBranch(const Spot& spot, std::uint32_t turn = 0) const;
  std::optional<std::uint32_t> previousBranch(const Spot& spot) const;
  // From the fork behind into the child after the one that leads here.
  std::optional<std::uint32_t> otherBranch(const Spot& spot) const;
  std::uint32_t root(const Spot& spot) const;
  // Tips of its tree, the nearest along the path first, at most `most`; not the spot itself. O(samples log samples).
  std::vector<std::uint32_t> tips(const Spot& spot, std::size_t most) const;
  // The tip that is farthest along the path. O(samples).
  std::optional<std::uint32_t> farthestTip(const Spot& spot) const;

  // Along the shortest path; none where no path joins them. O(samples log samples).
  std::optional<double> pathLength_um(const Spot& a, const Spot& b) const;
  // The samples passed by from a to b, beginning with an end of a's segment; empty where no path joins them.
  std::vector<std::uint32_t> path(const Spot& a, const Spot& b) const;

 private:
  struct Reached {
    std::vector<double> length_um;  // infinite: not reached
    std::vector<std::uint32_t> before;
  };
  Reached reach(const Spot& from) const;
  std::optional<double> lengthTo(const Reached& reached, const Spot& from, const Spot& to,
                                 std::uint32_t* by = nullptr) const;
  double distance(std::uint32_t a, std::uint32_t b) const {
    return (graph_.position_W(a) - graph_.position_W(b)).norm();
  }
  bool isTip(std::uint32_t node) const;

  CellGraph graph_;
  std::vector<bool> is_soma_end_;                      // by sample: see Soma::dead_ends
  std::vector<std::uint32_t> parents_, segment_at_;    // by sample; of the second, a segment that ends there
  std::vector<std::uint32_t> first_child_, children_;  // children of n: children_[first_child_[n] .. first_child_[n+1])
  std::vector<std::uint32_t> first_neighbour_, neighbours_;
};

}  // namespace filiform
