// Growth: adds cells to a tile set, removes some, and makes the result compact again.
//
// addCells() and removeCells() keep about 1 KiB of memory for each tile and cell of the set, within `memory`: they
// throw InputError if it is too little.
//
// Each call publishes a new revision as ingest() does: at once, an open reader keeps its revision, and a failure leaves
// the set unchanged. A grown revision refers to the packs of older revisions, which stay. It writes only the tiles that
// change: a tile to which few segments are added gets a patch. Exact searches find the same as in a set made at once.
// compactSet() rewrites everything: its bytes are those of one ingest of all cells.
#pragma once

#include "index/ingest/ingest.h"

#include <cstdint>
#include <string>
#include <vector>

namespace filiform {

struct GrowthResult {
  IngestResult set;
  std::uint64_t tiles_kept = 0, tiles_patched = 0, tiles_written = 0;
  bool compacted = false;       // everything was rewritten, because the addition is not small against the set
  bool levels_dropped = false;  // the set had levels of detail; compactSet() makes them again
};

// Adds the stream's cells. Their ids follow those of the set. Of the options, `capacity` and `quantum_exponent` are
// those of the set, and `force` has no meaning. If the cells have more than half as many segments as the set, the
// whole set is rewritten as compactSet() does. O(cells and tiles of the set + segments added).
//
// Throws InputError if the set already has a cell of the same name, IoError if there is no set, and what ingest()
// throws.
GrowthResult addCells(CellStream& cells, const std::string& path, const IngestOptions& options = {});

// Removes the cells of these names. The ids of the others do not change. Each tile that held a segment of them is
// written anew. O(cells and tiles of the set + segments of those tiles). Throws UsageError for an unknown name, and
// what ingest() throws.
GrowthResult removeCells(const std::vector<std::string>& names, const std::string& path,
                         const IngestOptions& options = {});

// Rewrites a set as one ingest of its cells, in the order of their sources, would write it, and removes all older
// revisions. Cells get new ids if some were removed. Options as for addCells(). O(segments).
GrowthResult compactSet(const std::string& path, const IngestOptions& options = {});

}  // namespace filiform
