// The segment properties of Neuroglancer skeletons: the text of `segment_properties/info`.
#pragma once

#include "index/attributes/cell_attributes.h"
#include "index/set/tile_store.h"

#include <cstdint>
#include <string>
#include <vector>

namespace filiform {

// A skeleton: its number (cell_numbers.h) and the cell.
struct SkeletonCell {
  std::uint64_t number;
  std::uint32_t cell;
};

// For each cell its number, its name as label, its source as description, and its samples, segments and roots as
// numbers. Of the attributes: a text column with at most 256 different texts becomes tags NAME=TEXT, by which
// Neuroglancer filters (blanks are written `_`, and the description of the tag has them); a number that every cell has
// becomes a number, unless an integer has more than 32 bits; any other column becomes a string, empty where the cell
// has no value, with the type of a number as its description. An attribute `source`, `samples`, `segments` or `roots`
// stands in the place of the property. SegmentProperties reads the attributes back. `attributes` may be nullptr.
// Throws what the store and the attributes throw. O(cells * columns).
std::string skeletonProperties(const TileStore& store, const std::vector<SkeletonCell>& cells,
                               const CellAttributes* attributes);

}  // namespace filiform
