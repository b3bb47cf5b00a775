// The options and the result of ingest(). Thread rule: values.
#pragma once

#include "index/geometry/grid.h"
#include "index/geometry/partition.h"
#include "index/ranks/ranks.h"
#include "index/set/provenance.h"
#include "index/set/set_counts.h"

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace filiform {

// Smallest value of IngestOptions::memory, bytes.
inline constexpr std::uint64_t kMinIngestMemory = std::uint64_t{64} << 20;

// Options of ingest(). Those "for tests" bound sizes that otherwise follow from `memory`.
struct IngestOptions {
  std::uint32_t capacity = PartitionOptions{}.capacity;
  int quantum_exponent = Grid::kDefaultExponent;
  unsigned threads = 0;  // 0: one a processor; at most 256, and one for each 16 MiB of memory
  // Bytes for the process, excluding 32 MiB; at least kMinIngestMemory. Data beyond it go to temporary files in the
  // set's folder: first about 14 bytes a segment, later as much as the set. Of this memory each tile takes 512 bytes
  // and each cell 512 bytes plus its names. Ingest refuses if less than an eighth remains, or if one tile does not fit.
  std::uint64_t memory = std::uint64_t{1} << 30;
  std::uint64_t stream_bytes = 0;                       // part of `memory` that the stream and its lists already use
  std::uint64_t reading_bytes = 0;                      // and a part that it uses only until it ends
  std::uint64_t chunk_segments = 0;                     // for tests: most segments in memory at once; 0: by memory
  std::uint64_t pack_bytes = std::uint64_t{256} << 20;  // for tests: bytes after which a pack ends
  std::uint32_t page_tiles = 64;                        // for tests: tiles of a page of the directory; a power of 2
  std::uint32_t group_pages = 1;                        // for tests: pages of a group of the directory; a power of 2
  bool levels = false;                                  // write levels of detail, needed to view large sets
  bool force = false;                                   // replace an existing set
  // Not null: these processes make the set together. Each passes its own cells to ingest(), and the cells of a rank
  // have lower ids than those of the next rank. All other options are equal, except `cancel` and the functions.
  // `provenance` is then called on every rank, after all streams' ends; rank 0 returns the provenance of all.
  Ranks* ranks = nullptr;
  const std::atomic<bool>* cancel = nullptr;    // when true: stop, clean up, throw Interrupted
  std::function<Provenance()> provenance = {};  // called once after the stream's end; may be empty
  // Called once after the stream's end: the set's sections, name and bytes. May be empty.
  std::function<std::map<std::string, std::vector<std::uint8_t>>()> sections = {};
  // Called now and then on the calling thread. `total` is 0 if it is unknown.
  std::function<void(const char* phase, std::uint64_t done, std::uint64_t total)> progress = {};
};

// What was written.
struct IngestResult {
  std::string revision;
  SetCounts counts;
  std::uint64_t bytes = 0;        // of all files of the set
  std::uint64_t spool_bytes = 0;  // largest size of the temporary files
  bool unchanged = false;         // with `force`: the existing set was identical and was kept
};

}  // namespace filiform
