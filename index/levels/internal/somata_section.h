// The sections that a grown set keeps for its levels of detail: somata, and the mark that the levels were dropped.
// FORMAT.md specifies both. Thread rule: functions without state.
#pragma once

#include "index/file/internal/bytes.h"
#include "index/levels/internal/level_input.h"
#include "index/set/tile_set.h"

#include <vector>

namespace filiform::internal {

inline constexpr const char* kSomataSection = "somata";
inline constexpr const char* kLevelsDroppedSection = "levels-dropped";  // no bytes; compactSet() makes levels again

// Requires ascending cells. O(somata).
Bytes encodeSomata(const std::vector<SomaRoot>& somata);
// The somata of a set, ascending by cell; none without the section. Throws CorruptSet, IoError. O(somata).
std::vector<SomaRoot> storedSomata(const TileSet& set);
// True if the set has levels of detail, or had them before it grew.
bool wantsLevels(const TileSet& set);

}  // namespace filiform::internal
