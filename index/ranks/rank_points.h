// RankPoints: deals points to ranks, and gathers what each rank found. Thread rule: as Ranks. All functions are calls
// of all ranks together, and throw what Ranks throws.
#pragma once

#include "index/geometry/grid.h"
#include "index/ranks/ranks.h"

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace filiform::tools {

// Some points of a list.
struct PointPart {
  std::vector<Vector3d> points;
  std::vector<std::size_t> positions;  // in the list
};
PointPart wholePart(std::span<const Vector3d> points);

class RankPoints {
 public:
  explicit RankPoints(Ranks& ranks) : ranks_(ranks) {}

  // Compares a text of every rank with that of rank 0. Throws IoError on a rank where it differs: `what`, and both.
  void compare(const std::string& what, const std::string& mine);
  // The number of rank 0.
  std::size_t ofFirst(std::size_t mine);

  // Each rank gets a consecutive part of the points' order along the space-filling curve, with about equal numbers.
  // `points`: those of rank 0 count.
  PointPart deal(const Grid& grid, std::span<const Vector3d> points);
  // Passes a text for each point of a part to rank 0. Returns there the texts by position in the list; elsewhere,
  // nothing.
  std::vector<std::string> gather(const PointPart& part, const std::vector<std::string>& texts);

 private:
  Ranks& ranks_;
};

}  // namespace filiform::tools
