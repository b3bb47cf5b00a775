// Makes the provenance of a tile set from the reports of its inputs.
//
// Thread rule: pure functions.
#pragma once

#include "index/circuits/placements.h"
#include "index/input/input.h"
#include "index/set/provenance.h"

#include <vector>

namespace filiform {

// The sources, the refused and skipped inputs and the codes of all inputs, and of the table of placements if one is
// given. Requires complete reports. The order of the reports has no effect. The result refers to `reports`, which must
// outlive it. O(n log n) for n sources and entries.
Provenance provenanceOf(const std::vector<SourceReport>& reports, const PlacedCells* placed = nullptr);

// Throws InputError if no set may be made: no input is usable, or no row of the placements places a morphology; with
// `strict`, also if an input was refused or a row dropped. Requires complete reports.
void requireUsable(const std::vector<SourceReport>& reports, const PlacedCells* placed, bool strict);

}  // namespace filiform
