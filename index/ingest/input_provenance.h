// Makes the provenance of a tile set from the reports of its inputs.
//
// Thread rule: pure functions.
#pragma once

#include "index/circuits/placements.h"
#include "index/input/input.h"
#include "index/set/provenance.h"

#include <string>
#include <vector>

namespace filiform {

// The sources, the refused inputs and the codes of all inputs, and of the table of placements if one is given. Requires
// complete reports. The order of the reports has no effect. The result refers to `reports`, which must outlive it.
// O(n log n) for n sources and entries.
Provenance provenanceOf(const std::vector<SourceReport>& reports, const PlacedCells* placed = nullptr);

// Why an input was refused: its refusing code with the token, or its warnings, which refuse it under --strict.
std::string refusedFor(const InputReport& report);

}  // namespace filiform
