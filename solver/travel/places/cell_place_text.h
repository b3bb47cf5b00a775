// Places on a cell as the user writes them, in the program, over HTTP, in Python and in the window:
//
//   CELL:soma      its soma
//   CELL:ID        a sample, by its id in the file
//   CELL:ID+T      between the sample (T = 0) and its parent (T = 1)
//   CELL:X,Y,Z     the sample of the cell that is nearest to a point, um
//   CELL:sectionN+POS  in a section as SONATA and NEURON number them (index/query/cell_sections.h), from its beginning
//                  (POS = 0) to its end (POS = 1); without POS in its middle
//
// Thread rule: functions without state.
#pragma once

#include "index/errors.h"
#include "index/geometry/grid.h"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace filiform {

class CellPaths;
struct CellPlace;

struct CellPlaceText {
  std::string option;                         // for messages: where the text was given, and the text
  std::string cell;                           // a name or a part of it
  bool soma = false;                          // else:
  std::optional<Vector3d> p_W = {};           // the nearest sample; else:
  std::optional<std::uint32_t> section = {};  // its number; else:
  std::int64_t sample = 0;                    // id in the file
  double t = 0;  // 0 the sample .. 1 its parent; in a section, 0 its beginning .. 1 its end

  bool needsTypes() const { return soma || section; }
};

inline constexpr const char* kCellPlaceForms =
    "CELL:soma, CELL:ID with the id of a sample, CELL:ID+T with T from 0 (the sample) to 1 (its parent), CELL:X,Y,Z "
    "for "
    "the sample nearest to a point, um, or CELL:sectionN+POS with POS from 0 to 1";

// The last colon ends the name of the cell. Nullopt for a text of another form.
std::optional<CellPlaceText> readCellPlace(const std::string& text);
// Throws UsageError, which names `option` and the forms, instead of returning nullopt.
CellPlaceText parseCellPlace(const std::string& option, const std::string& text);

// The places that the text means on a cell; several if the sample id repeats in the cell, or if it has several somata;
// by rank. needsTypes(): of a cell that was read with types and radii. Throws UsageError if the cell has no such sample
// (the message gives the nearest ids), no such section or no soma, or if t > 0 and the sample is not the child of
// exactly one segment. O(samples).
std::vector<CellPlace> placesOf(const CellPaths& cell, const CellPlaceText& text);

}  // namespace filiform
