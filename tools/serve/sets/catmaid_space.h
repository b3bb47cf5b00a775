// CatmaidSpace: a set as CATMAID's clients see it: 32-bit ids, and levels of detail as grids of cubes in nm.
//
// CATMAID's clients hold a node's id as int32 and a skeleton's as uint32. A skeleton is a cell; its id is the cell's
// id + 1. Samples have the ids 1, 2, 3 and so on, by cell and rank. Nodes of levels of detail, which are no samples,
// have the ids after these. Thread rule: immutable.
#pragma once

#include "index/levels/levels.h"

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

namespace filiform::tools {

class CatmaidSpace {
 public:
  // One level: the coarsest first, full resolution last.
  struct Level {
    int depth = 0;                 // of the level tiles' blocks at least; kFull: full resolution
    std::int64_t edge = 0;         // of a cube, quanta; a power of two, whole nm
    std::uint64_t most_nodes = 0;  // in a cube, about
  };
  static constexpr int kFull = kMortonBits + 1;

  // Set and levels (nullptr: none) must outlive this object. Calls `check` once for each 256 cells; it may throw to
  // stop. Throws Refusal (413) if the ids exceed 32 bits; also what the set throws. O(cells + level tiles).
  CatmaidSpace(const TileSet& set, const Levels* levels, const std::function<void()>& check = {});

  const std::vector<Level>& levels() const { return levels_; }
  double edge_nm(const Level& level) const { return static_cast<double>(level.edge) * quantum_nm_; }

  std::int32_t node(std::uint32_t cell, std::uint32_t rank) const {
    return static_cast<std::int32_t>(first_nodes_[cell] + rank);
  }
  std::int32_t levelNode(LevelId level, std::uint32_t node) const {
    return static_cast<std::int32_t>(first_level_nodes_[level] + node);
  }
  // Throws Refusal (413) if ids for `more` nodes after `nodes` exceed int32.
  static void checkNodes(std::uint64_t nodes, std::uint64_t more);
  static std::uint32_t skeleton(std::uint32_t cell) { return cell + 1; }
  // nullopt: there is no such cell, or it was removed.
  std::optional<std::uint32_t> cellOf(std::uint64_t skeleton) const;

 private:
  void addLevels(const Levels* levels);

  const TileSet& set_;
  double quantum_nm_;
  std::vector<std::uint32_t> first_nodes_, first_level_nodes_;
  std::vector<Level> levels_;
};

}  // namespace filiform::tools
