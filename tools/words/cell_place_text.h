// Places on a cell as the user writes them: CELL:SAMPLE, or CELL:SAMPLE+T between a sample and its parent. Thread rule:
// functions without state.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace filiform {
class CellPaths;
struct CellPlace;
}  // namespace filiform

namespace filiform::tools {

struct CellPlaceText {
  std::string option;       // for messages: where the text was given, and the text
  std::string cell;         // a name as findCellNamed() takes it
  std::int64_t sample = 0;  // id in the file
  double t = 0;             // 0 the sample .. 1 its parent
};
// The last colon ends the name of the cell. Throws UsageError, which names `option` and the accepted form.
CellPlaceText parseCellPlace(const std::string& option, const std::string& text);

// The places that the text means on a cell; several if the sample id repeats in the cell, by rank. Throws UsageError if
// the cell has no such sample (the message gives the nearest ids), or if t > 0 and the sample is not the child of
// exactly one segment. O(samples).
std::vector<CellPlace> placesOf(const CellPaths& cell, const CellPlaceText& text);

}  // namespace filiform::tools
