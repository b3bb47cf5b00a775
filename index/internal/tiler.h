// From a stream of cells to the segments of each leaf, in bounded memory.
//
//  read     Segments go to the *chunk* of their midpoint: a cell of the partition, halved like a leaf once it holds
//  more than
//           a chunk may, so that nobody needs to know beforehand where the data are. What a chunk held when it was
//           halved follows to its halves when everything is read. Chunks lie in a spool: in memory while they are few.
//  cut      Each chunk, on its own, is split into leaves by its midpoints; a chunk's cell is one that the whole
//  partition
//           splits too, so these are the leaves of all midpoints together. Segments that touch the border of their
//           chunk are put aside, and then given to all chunks that they meet.
//  tiles    Each chunk, on its own, hands over its leaves.
//
// Nothing depends on the size of the chunks but time and memory. Memory: what is given. Its shares: a quarter for the
// spool's blocks, a sixteenth for buffers of chunks that are being written, an eighth for what the sink keeps, the rest
// for chunks at work and for what each leaf, cell, chunk and block takes. Where less than an eighth is left to work
// with, or a tile does not fit it, the tiler refuses before it makes a tile.
#pragma once

#include "index/internal/segment_chain.h"
#include "index/partition.h"
#include "index/samples.h"
#include "index/tile_writer.h"

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
  std::uint64_t beside = 0;           // bytes of it that others take
  std::uint64_t chunk_segments = 0;   // most in a chunk; 0: what suits the memory
  unsigned threads = 1;               // at work on chunks, the caller's included
  std::string folder = {};            // for the spool's file; empty: all in memory
  const std::atomic<bool>* cancel = nullptr;
  // From the calling thread. What it throws ends the work.
  std::function<void(const char* phase, std::uint64_t done, std::uint64_t total)> progress = {};
};

// Takes what each leaf stores, in any order of leaves, from several threads.
class TileSink {
 public:
  virtual ~TileSink() = default;
  // `leaf` is a position in Tiler::leaves(), or their number for the long-segment tile. Segments ascend by id,
  // attributes are the children's. `worker` < options.threads: calls of one worker follow one another.
  virtual void add(unsigned worker, std::uint32_t leaf, const CellKey& key, bool is_long,
                   std::vector<StoredSegment>& segments, TileAppearance& appearance) = 0;
};

// Thread-compatible; starts threads of its own. Throws Interrupted when `cancel` becomes true, IoError when the spool
// cannot be written, UsageError for a cell whose arrays disagree, InputError when there is too much of something: where
// it is too much for the memory, the message names what it takes.
class Tiler {
 public:
  explicit Tiler(TilerOptions options);
  ~Tiler();

  // Once each, in this order.
  void read(CellStream& stream);
  void cut();
  void tiles(TileSink& sink);
  SamplePoints samples();
  // For each cell in the order of ids: what encodeDetail() makes of its detail, in which tiles are numbered by
  // `tile_of`, a number for each leaf.
  void details(std::span<const TileId> tile_of, const std::function<void(ByteSpan detail)>& use);

  // After tiles(), when nothing else takes memory but what the tiler holds and 900 bytes a tile.
  TileWriter::LevelMemory memoryForLevels() const;

  const std::vector<CellKey>& leaves() const;      // after cut(): all, ascending; those without segments too
  const std::vector<CellRecord>& records() const;  // after read()
  const std::vector<std::uint64_t>& digests() const;
  std::uint64_t segments() const;          // isolated ones included
  std::uint64_t spool_file_bytes() const;  // the most that was on disk
  std::size_t chunks() const;              // after read()
  std::uint64_t visited() const;           // after tiles(): nodes of the partition, in search of what segments meet

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform::internal
