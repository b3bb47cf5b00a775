// Tiler: turns a stream of cells into the segments of each leaf, in bounded memory.
//
//   read    Segments go to the block of their midpoint. A block with many segments is halved, so the data's extent need
//           not be known beforehand. Once input ends, blocks become *chunks* (chunks.h). They lie in a spool: in memory
//           while they are few.
//   cut     Each chunk is split into leaves by its midpoints. The whole partition splits every block above a chunk too,
//           so these are the leaves of all midpoints together. Segments that touch the border of their chunk are set
//           aside, then given to all chunks that they meet.
//   tiles   Each chunk passes its leaves on.
//
// The size of the chunks affects only time and memory. Shares of the memory: a quarter for the spool's blocks, a
// sixteenth for buffers of chunks that are being written, an eighth for the sink. The rest is for chunks at work and
// for each leaf, cell, chunk and block. If less than an eighth remains to work with, or a tile does not fit it, the
// tiler refuses before it makes a tile.
#pragma once

#include "index/attributes/internal/attributes_section.h"
#include "index/geometry/partition.h"
#include "index/ingest/growth/internal/stored_cells.h"
#include "index/ingest/tiling/internal/leaf_content.h"
#include "index/ingest/tiling/internal/tile_sink.h"
#include "index/ingest/tiling/internal/tile_writer.h"
#include "index/ingest/tiling/landmarks.h"
#include "index/ranks/ranks.h"

#include <atomic>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace filiform::internal {

struct TilerOptions {
  Grid grid;
  std::uint32_t capacity = 0;
  std::uint64_t memory = UINT64_MAX;  // bytes
  std::uint64_t beside = 0;           // bytes of `memory` used elsewhere
  std::uint64_t reading = 0;          // and more of them until the cells are read
  std::uint64_t chunk_segments = 0;   // most segments of a chunk; 0: by memory
  unsigned threads = 1;               // threads that work on chunks, including the caller's
  std::string folder = {};            // for the spool's file; empty: all in memory
  Ranks* ranks = nullptr;             // not null: these processes tile together
  const std::atomic<bool>* cancel = nullptr;
  // Called from the calling thread. An exception that it throws ends the work.
  std::function<void(const char* phase, std::uint64_t done, std::uint64_t total)> progress = {};
};

// Thread rule: thread-compatible; starts its own threads. Throws Interrupted if `cancel` becomes true, IoError if the
// spool cannot be written, UsageError for a cell whose arrays disagree in length. Throws InputError for too much data;
// the message names the memory needed.
class Tiler {
 public:
  explicit Tiler(TilerOptions options);
  ~Tiler();

  // Call each once, in this order. With several ranks, each passes other cells, by rank in the order of ids. Leaves and
  // segments are then those of all ranks, and tiles() passes on the leaves of this rank; the long-segment tile comes
  // from the last rank. landmarks(), details(), records() and what else belongs to cells are for rank 0.
  void read(CellStream& stream);
  void read(const StoredCells& cells);  // instead: cells of existing sets
  void cut();
  void tiles(TileSink& sink);
  Landmarks landmarks();
  // Calls `use` for each cell, in the order of ids, with its detail from encodeDetail(). `tile_of` holds the tile id of
  // each leaf.
  void details(std::span<const TileId> tile_of, const std::function<void(ByteSpan detail)>& use);

  // The memory for levels of detail, and the message for too little. After tiles(), when nothing else takes memory but
  // what the tiler holds, 320 bytes a tile, and an eighth for neurites. Moves large details of cells to a file.
  LevelOptions optionsForLevels();
  const std::vector<SomaRoot>& somata() const;  // after read()
  const AttributeTable& attributes() const;     // after read()

  const std::vector<BlockKey>& leaves() const;  // after cut(): all leaves, ascending, also those without segments
  const std::vector<std::uint32_t>& midpoints() const;  // after cut(): of segments, in each leaf
  const std::vector<CellRecord>& records() const;       // after read()
  const std::vector<std::uint64_t>& digests() const;
  std::uint64_t segments() const;          // isolated ones included
  GridBox bounds() const;                  // of all samples
  std::uint32_t first_leaf() const;        // of this rank
  std::uint64_t spool_file_bytes() const;  // largest size on disk
  std::size_t chunks() const;              // after read()
  std::uint64_t visited() const;           // after tiles(): visited nodes of the partition

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform::internal
