// Cells in, a tile set on disk out.
#pragma once

#include "index/cell.h"
#include "index/partition.h"
#include "index/provenance.h"
#include "index/tile_set.h"

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>

namespace filiform {

inline constexpr std::uint64_t kMinIngestMemory = std::uint64_t{64} << 20;

struct IngestOptions {
  std::uint32_t capacity = PartitionOptions{}.capacity;
  int quantum_exponent = Grid::kDefaultExponent;
  unsigned threads = 0;  // 0: as many as the machine has; at most 256 and one per 16 MiB of memory
  // Memory of the process but for 32 MiB, at least kMinIngestMemory. What does not fit goes to a file in the set's
  // folder, about 14 bytes a segment and then as much as the set. Each tile takes 512 bytes of it, each cell 512 and
  // its names: where no eighth of it is left to work with, or one tile takes more than there is, ingest refuses.
  std::uint64_t memory = std::uint64_t{1} << 30;
  std::uint64_t stream_bytes = 0;    // of this memory, what the stream and its lists take already
  std::uint64_t chunk_segments = 0;  // for tests: worked on together at most, everything else in the file
  std::uint64_t pack_bytes = std::uint64_t{256} << 20;  // for tests: a pack ends before the tile that would exceed this
  bool levels = false;                                  // write levels of detail too, for the eye
  bool force = false;                                   // replace a set that is there already
  const std::atomic<bool>* cancel = nullptr;            // when it becomes true: stop, clean up, throw Interrupted
  std::function<Provenance()> provenance = {};          // asked once, after the stream has ended; may be empty
  // Called now and then from the calling thread; `total` is 0 where it is unknown.
  std::function<void(const char* phase, std::uint64_t done, std::uint64_t total)> progress = {};
};

struct IngestResult {
  std::string revision;
  SetCounts counts;
  std::uint64_t bytes = 0;        // of all files
  std::uint64_t spool_bytes = 0;  // the most that was put aside on disk while segments were sorted
  bool unchanged = false;         // --force met the very same set; it was left as it was
};

// Reads the stream to its end and publishes a tile set at `path`, atomically: until the end a set that is there stays
// in force, and whatever fails leaves no trace. One ingest a set at a time. Deterministic: the same cells and options
// give the same bytes. Throws InputError when there is a set already and not `force`, when the folder holds anything
// else, when another ingest is at work, or, naming the memory that it takes, when a cell, a tile or all
// cells and tiles together do not fit; IoError (disk full, no permission); Interrupted; UsageError for options out of
// range; and whatever the stream throws. The bytes depend neither on threads nor on memory. O(n).
IngestResult ingest(CellStream& cells, const std::string& path, const IngestOptions& options = {});

}  // namespace filiform
