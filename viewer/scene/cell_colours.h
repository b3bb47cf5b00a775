// Colours of cells by an attribute (index/attributes/cell_attributes.h) or by numbers, with the legend. Functions
// without state.
#pragma once

#include "index/attributes/cell_attributes.h"
#include "viewer/scene/colour.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace filiform {

// Of cells that are not selected: near the ground.
constexpr Rgba unchosenOn(Theme theme) { return theme == Theme::light ? Rgba{205, 208, 214} : Rgba{58, 62, 70}; }

struct CellColours {
  struct Entry {
    std::string value;  // of the attribute, as text; kWithoutValueText for cells without one; a range for a ramp
    Rgba colour;
    std::uint64_t cells = 0;  // at least one, of those in `only`; 0: not counted
    bool chosen = true;
  };
  std::string attribute;  // empty: cells have their own colours, and only the selection counts
  std::string unit;       // of its values; empty: none, or not known
  std::vector<Rgba> of_cell;
  std::vector<bool> is_chosen;  // by cell: it has a colour of its own; empty: all have
  Rgba unchosen = unchosenOn(Theme::dark);
  std::vector<Entry> legend;
};

inline constexpr const char* kWithoutValueText = "(none)";  // in the legend; such cells are grey
inline constexpr std::size_t kMostNumberValues = 12;        // more numbers than these share the steps of the ramp

// A number of each cell, by id. NaN: missing.
struct CellValues {
  std::string name, unit;  // as the legend shows them: `measure:length`, `um`; not empty, may be empty
  std::vector<double> of_cell;
};

// The cells that have a colour; others get unchosenOn(theme).
struct CellSelection {
  std::optional<std::vector<std::uint32_t>> only{};  // ascending ids; the legend counts these; none: all
  std::optional<std::vector<std::string>> values{};  // of the legend; none: all
  Theme theme = Theme::dark;
};

// The legends of ColourBy::type, depth and radius. Types in the order 1 to 4, then all others (0).
const std::vector<CellColours::Entry>& legendOfTypes();
std::vector<CellColours::Entry> legendOfDepths(double shallow_um, double deep_um);
const std::vector<CellColours::Entry>& legendOfRadii();

// The colours of all cells by the attribute. Texts get a colour each. Numbers get a ramp from the lowest to the
// highest, many different ones in eight steps. Cells without a value are grey. An empty attribute gives each cell its
// own colour. Throws UsageError for an unknown attribute, CorruptSet, IoError. O(cells log values).
std::shared_ptr<const CellColours> coloursByAttribute(const TileSet& set, const CellAttributes& attributes,
                                                      const std::string& attribute,
                                                      const CellSelection& selection = {});
// Likewise by numbers. Requires one for each cell.
std::shared_ptr<const CellColours> coloursByNumbers(const TileStore& store, const CellValues& numbers,
                                                    const CellSelection& selection = {});

}  // namespace filiform
