// What differs between two versions of a cell: samples, links, radii, types, place.
//
//   const CellChange change = compareCells(readCell(*old_set, a, true), readCell(*new_set, b, true));
//   if (change.kind == CellFate::kChanged) std::cout << change.samples_added << " samples added\n";
//
// Names, ids, headers and the order of samples do not count, and links have no direction. Thread rule: pure functions.
#pragma once

#include "index/query/cell_graph.h"

#include <cstdint>
#include <string_view>

namespace filiform {

enum class CellFate : std::uint8_t { kSame, kMoved, kChanged, kAdded, kRemoved };
std::string_view name(CellFate kind);  // "same", "moved", "changed", "added", "removed"

struct CellChange {
  CellFate kind = CellFate::kSame;
  // Of kMoved: how far the first sample is from its old place, um, and the angle of the rotation, rad.
  double moved_um = 0, turned_rad = 0;
  // Of kChanged. A sample without a counterpart at its position is added or removed; one with another radius or type at
  // its position is edited. A segment is known by the positions of its ends.
  std::uint64_t samples_added = 0, samples_removed = 0, samples_edited = 0;
  std::uint64_t segments_added = 0, segments_removed = 0;
};

// kSame: equal positions, radii, types and segments, each as often; if the grids differ, positions that are equal up to
// rounding, in the same order. kMoved: the samples, in the same order and with the same links, radii and types, lie
// where a rotation and a translation put them, up to rounding, and one of them farther from its old place than rounding
// moves it. kChanged: all else. Never kAdded or kRemoved. Requires radii and types. O(n log n).
CellChange compareCells(const CellGraph& a, const CellGraph& b);

// The sum of all segments, um, those between samples of a soma included. O(samples).
double lengthOf_um(const CellGraph& cell);

}  // namespace filiform
