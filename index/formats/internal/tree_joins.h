// TreeJoins: where trees of a neuron begin on other trees of it, as an axon on a dendrite. Such a tree is joined there,
// not to the soma: the file states the place.
#pragma once

#include "index/geometry/grid.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <unordered_map>
#include <vector>

namespace filiform::internal {

// First all begins(), then all inside(), then at(). Trees are numbered from 0 in the order of begins(). Thread rule:
// thread-compatible.
class TreeJoins {
 public:
  // The first point of the next tree. `point`: a number of the caller, unique. O(log trees).
  void begins(std::size_t point, const Vector3d& position);
  // Another point of a tree. The trees that begin exactly there and have no join yet join here, unless this would close
  // a ring. O(log trees) without a join.
  void inside(std::size_t point, const Vector3d& position, std::uint32_t tree);
  // The point that stands for `point`: where its tree was joined, or `point` itself. O(1) expected.
  std::size_t at(std::size_t point) const;

 private:
  struct Begin {
    std::size_t point;
    std::uint32_t tree;
  };
  std::uint32_t groupOf(std::uint32_t tree);

  std::map<std::array<double, 3>, std::vector<Begin>> begins_;
  std::vector<std::uint32_t> joined_;  // for each tree, another one of its group, or itself
  std::unordered_map<std::size_t, std::size_t> stands_for_;
};

}  // namespace filiform::internal
