// Steps along the neurites of one cell, for users who travel by keys: to the next fork, the parent, a tip or the root;
// and path lengths (index/query/cell_paths.h). Thread rule: immutable after construction.
#pragma once

#include "index/query/cell_paths.h"
#include "solver/proxy/proxy_solver.h"

#include <cstdint>
#include <optional>
#include <vector>

namespace filiform {

class CellWalk {
 public:
  using Spot = CellPlace;

  // For a cell with loops, parents are those of its spanning forest, while paths may use every link. Samples that only
  // give a soma its shape are neither children nor tips; from a place on such a sample, parent() still leads to the
  // soma's root. O(samples).
  explicit CellWalk(CellGraph graph);

  const CellGraph& graph() const { return paths_.graph(); }
  const CellPaths& paths() const { return paths_; }
  std::uint32_t samples() const { return paths_.samples(); }

  // Nullopt if the place is not on a segment of this cell. O(1).
  std::optional<Spot> spotOf(const ProxyPlace& place) const;
  // The position of a sample: of a root, on the child's segment with the longest neurites. Requires node < samples().
  // O(1).
  Spot at(std::uint32_t node) const;
  Vector3d position_W(const Spot& spot) const { return paths_.position_W(spot); }

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
  // The way from the place along its parents to the root, um. O(samples on it).
  double toRoot_um(const Spot& spot) const;

 private:
  const std::vector<std::uint32_t>& parents() const { return graph().parents; }

  CellPaths paths_;
  std::vector<std::uint32_t> first_child_, children_;  // children of n: children_[first_child_[n] .. first_child_[n+1])
};

}  // namespace filiform
