// What is known of a place on a neurite, for people. Thread rule: values; functions without state.
#pragma once

#include "solver/proxy/proxy_solver.h"
#include "solver/travel/places/cell_walk.h"

#include <cstdint>
#include <optional>
#include <string>

namespace filiform::internal {

struct SeenNeurite {
  ProxyPlace place;
  std::string cell;                    // its name
  std::optional<std::int64_t> sample;  // id of the segment's child
  std::string kind;                    // kindText(); empty: not known
  double radius_um = 0;                // 0: not known
};

// "axon, 138 \u00b5m from the soma"; of a tree without a soma "from the root". Requires a spot of this cell.
std::string kindText(const CellWalk& walk, const CellWalk::Spot& spot);
// The tip of the place's own type that is farthest along the path; nullopt: no other can be reached. O(samples log
// samples).
std::optional<std::uint32_t> farthestTipOfKind(const CellWalk& walk, const CellWalk::Spot& spot);
// The radius between the samples, um; 0: not known.
double radiusAt_um(const CellWalk& walk, const CellWalk::Spot& spot);

std::string nameText(const SeenNeurite& seen);   // "CELL:ID", as the search takes it
std::string placeText(const SeenNeurite& seen);  // "x y z \u00b5m"

}  // namespace filiform::internal
