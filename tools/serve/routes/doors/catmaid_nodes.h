// CatmaidNodes: the nodes of a box at one level, as rows of CATMAID's node/list.
#pragma once

#include "tools/serve/sets/catmaid_space.h"
#include "tools/serve/sets/served_set.h"

#include <cstdint>
#include <string>
#include <unordered_map>
#include <vector>

namespace filiform::tools {

// Thread rule: thread-compatible.
class CatmaidNodes {
 public:
  // A segment belongs to the box that holds its middle: box.lo <= middle < box.hi; nm. So cubes side by side hold each
  // segment once.
  struct Box {
    Vector3d lo_nm, hi_nm;
  };

  // Reads the tiles of the box. Throws what the set throws, and AnswerTimeout. O(segments of these tiles).
  CatmaidNodes(const ServedSet& served, const CatmaidSpace& space, const CatmaidSpace::Level& level, const Box& box);

  // The rows [node, parent, x, y, z, confidence, radius, skeleton, time, user], with commas between. Both ends of a
  // segment are rows; the child's names the parent. The parent is null if the segment to it lies in another box. Of a
  // child with several parents, all but the first are left out: CATMAID knows only trees. x, y, z and radius are in nm;
  // radius is -1 if it is unknown or that of a parent.
  std::string rows() const;
  bool truncated() const { return truncated_; }  // the rows end at a limit

 private:
  struct Node {
    std::int32_t id, parent;  // 0: none
    Vector3d p_nm;
    double radius_nm;
    std::uint32_t skeleton;
  };
  struct Source {
    const Tile& tile;
    const TileAppearance& appearance;
    bool level;
    LevelId id;
  };
  void addTile(TileId tile);
  void addLevel(LevelId level);
  void addPart(const LevelPart& part, int depth);
  void addSegments(const Source& source);
  std::size_t place(std::int32_t id, const Vector3d& p_nm, std::uint32_t cell);
  bool meets(const GridBox& content, double quantum_nm) const;

  const ServedSet& served_;
  const CatmaidSpace& space_;
  const Box box_;
  std::vector<Node> nodes_;
  std::unordered_map<std::int32_t, std::size_t> places_;
  bool truncated_ = false;
};

}  // namespace filiform::tools
