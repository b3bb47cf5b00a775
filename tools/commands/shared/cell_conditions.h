// The conditions of --where, with progress on stderr. Thread rule: any thread may call them.
#pragma once

#include "tools/words/filter_words.h"

#include <cstdint>
#include <vector>

namespace filiform::tools {

// CellConditions::select() and measureValues() of the set, on `threads` threads; 0: one a core. Throw Interrupted too.
std::vector<std::uint32_t> cellsMeeting(const CellConditions& conditions, const TileSet& set,
                                        const CellAttributes& attributes, unsigned threads);
std::vector<std::vector<double>> valuesOf(const TileStore& store, const std::vector<std::uint32_t>& cells,
                                          const std::vector<const Feature*>& features, unsigned threads);

}  // namespace filiform::tools
