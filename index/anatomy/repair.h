// Changes to one cell that make it easier for other programs to read, each with a record. Nothing is changed but what
// the options name, the radii that are unknown, the order of samples whose parent comes later, and ids that repeat.
#pragma once

#include "index/cell/cell.h"

#include <cstdint>
#include <string_view>
#include <vector>

namespace filiform {

struct RepairOptions {
  static constexpr double kLeastGap_um = 0.001, kMostGap_um = 100;  // of join_gaps_um
  // All links that AnatomyCheck names long, while it doubts them. The other options then make no link as long.
  bool drop_long_links = false;
  double join_gaps_um = 0;  // link trees whose ends lie nearer than this to another tree; 0: never
  bool soma_links = false;  // link roots that lie within kSomaReach_um of a soma's surface to the soma
  static constexpr double kSomaReach_um = 50;
  double unknown_radius_um = 0;  // finite, at least 0
};

struct RepairChange {
  enum class Kind : std::uint8_t {
    kLinkDropped,   // of `sample` to `other`, `value` um long
    kGapJoined,     // `sample` now has the parent `other`, `value` um away
    kSomaLinked,    // likewise; `other` is a sample of a soma
    kTurnedRound,   // `sample` was the root of a tree; `value` links on the way to its new root point the other way
    kRadiusSet,     // of `sample`, now `value`
    kRenumbered,    // `sample`, with `other` as new id
    kParentsFirst,  // `value` samples moved behind their parents
    kHeaderCut,     // lines of the header are left out
  };
  Kind kind{};
  std::uint64_t line = 0;  // of the file; 0: not known
  std::int64_t sample = 0, other = 0;
  double value = 0;
};
std::string_view name(RepairChange::Kind kind);  // "link_dropped"

// Changes the cell. A further call with the same options changes nothing. Requires a forest, valid options and a cell
// with at least one sample. Joins prefer the nearest pair; two trees with a soma each stay apart. O(samples log
// samples) for most cells; a gap costs the samples within that distance of an end.
std::vector<RepairChange> repair(Cell& cell, const RepairOptions& options);

}  // namespace filiform
