// Small cells for the tests of the evaluation.
#pragma once

#include "index/cell/cell.h"

#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

namespace filiform::test {

inline Cell cellOf(const std::vector<Vector3d>& positions_um, const std::vector<std::uint32_t>& parents) {
  Cell cell;
  cell.source = "cell.swc";
  cell.positions_um = positions_um;
  cell.parents = parents;
  for (std::size_t i = 0; i < positions_um.size(); ++i) {
    cell.sample_ids.push_back(static_cast<std::int64_t>(i) + 1);
    cell.radii_um.push_back(1);
    cell.types.push_back(3);
    cell.digest = cell.digest * 1000003 + static_cast<std::uint64_t>(std::llround(1000 * positions_um[i].sum()));
  }
  return cell;
}

// A random wandering tree. One link in eight has length 0.
inline Cell randomTree(std::uint64_t seed, std::uint32_t samples) {
  std::mt19937_64 random(seed);
  const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-53 - 0.5; };
  std::vector<Vector3d> positions{Vector3d::Zero()};
  std::vector<std::uint32_t> parents{kNoParent};
  for (std::uint32_t i = 1; i < samples; ++i) {
    const std::uint32_t parent = random() % 4 == 0 ? static_cast<std::uint32_t>(random() % i) : i - 1;
    const double length = random() % 8 == 0 ? 0 : 10;
    parents.push_back(parent);
    positions.push_back(positions[parent] + length * Vector3d(uniform(), uniform(), uniform()));
  }
  return cellOf(positions, parents);
}

}  // namespace filiform::test
