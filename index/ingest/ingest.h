// Ingest: reads a stream of cells and writes a tile set to disk.
#pragma once

#include "index/cell/cell.h"
#include "index/geometry/partition.h"
#include "index/ingest/ingest_options.h"
#include "index/ranks/ranks.h"
#include "index/set/provenance.h"
#include "index/set/tile_set.h"

#include <string>

namespace filiform {

// Reads the stream to its end and publishes a tile set at `path`. Publishing is atomic: an existing set stays valid
// until then, and a failure leaves it unchanged. Only one ingest may write a set at a time. The same cells and options
// give the same bytes, whatever the threads and memory. O(n).
//
// Throws:
//   InputError    a set exists and `force` is false, the folder holds other files, or another ingest is writing there.
//                 Also if a cell, a tile, or all cells and tiles do not fit the memory; the message names the need
//   IoError       the disk is full or permission is missing
//   Interrupted   `cancel` became true
//   UsageError    an option is out of range
//   RankFailed    with several ranks: another rank failed
// and what the stream throws.
IngestResult ingest(CellStream& cells, const std::string& path, const IngestOptions& options = {});

}  // namespace filiform
