#include "index/circuits/placements.h"
#include "index/errors.h"
#include "tests/fuzz/fuzz_bytes.h"

#include <cmath>

namespace filiform::fuzz {

void fuzzPlacements(Input input) {
  try {
    const PlacementTable table = PlacementTable::parse(asText(input), "fuzz.tsv");
    for (const PlacementTable::Row& row : table.rows()) {
      require(row.source < table.sources().size(), "a row has a source");
      double squared = 0;
      for (const double value : row.turned) squared += value * value;
      require(std::fabs(squared - 1) < 1e-12, "quaternions have length 1");
      for (const double value : row.moved_um) require(std::isfinite(value), "places are finite");
      table.name(row);
    }
  } catch (const InputError&) {
  }
}

}  // namespace filiform::fuzz
