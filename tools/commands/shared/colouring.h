// What --colour-by names: a kind of colours, a measure of the cells, or an attribute. Thread rule: values; functions
// without state.
#pragma once

#include "index/measure/measures.h"
#include "index/set/tile_set.h"
#include "viewer/scene/neurite_batches.h"

#include <optional>
#include <string>

namespace filiform::tools {

struct Colouring {
  std::optional<ColourBy> kind;      // cell, type, depth, radius, tile
  const Feature* feature = nullptr;  // of `measure:FEATURE`
  std::string attribute;             // NAME, or `attribute:NAME`; empty: one of the others
  bool isOfCells() const { return !kind; }
};

// Throws UsageError for an unknown measure, with near names.
Colouring parseColouring(const std::string& name);
// Throws UsageError if the set has no such attribute, with all names; without a set, if the colouring is an attribute.
void checkColouring(const Colouring& colouring, const std::string& name, const TileSet* set);

inline constexpr const char* kColouringHelp =
    "colour by cell, type, depth, radius, tile, an attribute of the cells such as mtype, or measure:FEATURE, a feature "
    "of filiform measure; attribute:type is an attribute of this name; cells without a value are grey";

}  // namespace filiform::tools
