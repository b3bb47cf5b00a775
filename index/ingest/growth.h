// Growth: adds cells to a tile set, removes some, lets a set follow its inputs, and makes the result compact again.
//
// addCells(), removeCells() and syncCells() keep about 1 KiB of memory for each tile and cell of the set, within
// `memory`: they throw InputError if it is too little.
//
// Each call publishes a new revision as ingest() does: at once, an open reader keeps its revision, and a failure leaves
// the set unchanged. A grown revision refers to the packs of older revisions, which stay. It writes only the tiles that
// change: a tile to which few segments are added gets a patch. Exact searches find the same as in a set made at once.
// compactSet() rewrites everything: its bytes are those of one ingest of all cells.
#pragma once

#include "index/ingest/growth/sync_fate.h"
#include "index/ingest/ingest.h"

#include <cstdint>
#include <functional>
#include <map>
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

struct SyncOptions {
  bool remove = false;  // remove the cells that are gone
  // Called once with the fates of all sources, before anything is refused or written. May be empty.
  std::function<void(const std::map<std::string, SyncFate>& fates)> fates = {};
};

struct SyncResult : GrowthResult {
  SyncCounts counts;
};

// Makes the set hold the cells of the stream: adds new ones, replaces changed ones, keeps equal ones, which are not
// written again. Cells are compared by source, digest, counts and box. A cell that is gone stays unless `remove` is
// set; one whose input cannot be used now stays in any case. Replaced cells pass on attributes that the stream does not
// state. Names are those that one ingest gives. Ids of new and changed cells follow those of the set. One revision is
// published. Without cells that are gone or held, compactSet() then gives the bytes of one ingest of the stream.
//
// `options` as for addCells(); `options.provenance` is called once, when the stream has ended, and must name all inputs
// of the stream, and those that cannot be used. Throws InputError if `remove` is set and an input is unreadable
// (E_UNREADABLE), since its cells only seem gone. Throws what addCells() throws, but for cells of the same name. Reads
// the whole stream. O(cells and tiles of the set + samples of the stream + segments changed).
SyncResult syncCells(CellStream& cells, const std::string& path, const SyncOptions& sync,
                     const IngestOptions& options = {});

// Rewrites a set as one ingest of its cells, in the order of their sources, would write it, and removes all older
// revisions. Cells get new ids if some were removed. Options as for addCells(). O(segments).
GrowthResult compactSet(const std::string& path, const IngestOptions& options = {});

}  // namespace filiform
