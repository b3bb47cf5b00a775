#include "index/build/ingest.h"

#include "index/build/internal/heap.h"
#include "index/build/internal/set_folder.h"
#include "index/build/internal/tile_stack.h"
#include "index/build/internal/tile_writer.h"
#include "index/build/internal/tiler.h"
#include "index/errors.h"

#include <algorithm>
#include <memory>
#include <thread>
#include <utility>

namespace filiform {
namespace {

constexpr unsigned kMostIngestThreads = 256;
constexpr std::uint64_t kMemoryOfThread = std::uint64_t{16} << 20;  // stack, buffers, arena and a tile at work

// Throws UsageError for options that cannot be. Returns the number of threads.
unsigned checkedThreads(const IngestOptions& options) {
  if (options.capacity == 0) throw UsageError("the capacity of a tile must be at least 1");
  if (options.quantum_exponent < Grid::kMinExponent || options.quantum_exponent > Grid::kMaxExponent)
    throw UsageError("the quantum must be a power of two from 2^-10 to 2^10 um");
  if (options.memory < kMinIngestMemory)
    throw UsageError("ingest needs at least " + std::to_string(kMinIngestMemory >> 20) + " MiB of memory");
  const unsigned wanted = options.threads != 0 ? options.threads : std::max(1u, std::thread::hardware_concurrency());
  return static_cast<unsigned>(std::min<std::uint64_t>({wanted, kMostIngestThreads, options.memory / kMemoryOfThread}));
}

}  // namespace

IngestResult ingest(CellStream& stream, const std::string& path, const IngestOptions& options) {
  const unsigned threads = checkedThreads(options);
  std::string folder = path;
  while (folder.size() > 1 && folder.back() == '/') folder.pop_back();
  const auto step = [&](const char* phase, std::uint64_t done, std::uint64_t total) {
    if (options.cancel != nullptr && options.cancel->load(std::memory_order_relaxed)) throw Interrupted("interrupted");
    if (options.progress) options.progress(phase, done, total);
  };

  internal::unmapLargeBlocksWhenFreed();

  internal::SetFolder set_folder(folder, options.force);
  const Grid grid(options.quantum_exponent);
  internal::Tiler tiler({.grid = grid,
                         .capacity = options.capacity,
                         .memory = options.memory,
                         .beside = options.stream_bytes,
                         .chunk_segments = options.chunk_segments,
                         .threads = threads,
                         .folder = set_folder.building(),
                         .cancel = options.cancel,
                         .progress = step});
  tiler.read(stream);
  tiler.cut();
  auto stack = std::make_unique<internal::TileStack>(grid, threads, set_folder.building(),
                                                     options.chunk_segments != 0 ? 0 : options.memory / 8);
  tiler.tiles(*stack);
  std::vector<internal::TileStack::Encoded> tiles = stack->finish();

  const auto leaf_count = static_cast<std::uint32_t>(tiler.leaves().size());
  const bool has_long = !tiles.empty() && tiles.back().leaf == leaf_count;
  TileWriter writer(set_folder.building(), grid, options.capacity, static_cast<TileId>(tiles.size()), has_long,
                    options.pack_bytes, options.page_tiles);
  step("choosing landmarks", 0, 0);
  writer.writeLandmarks(tiler.landmarks());
  std::vector<BlockKey> keys;
  std::vector<TileId> tile_of(leaf_count + 1, kNoTile);
  for (TileId t = 0; t < tiles.size(); ++t) {
    tile_of[tiles[t].leaf] = t;
    if (tiles[t].leaf < leaf_count) keys.push_back(tiles[t].entry.key);
  }
  const std::size_t tile_count = tiles.size();
  std::uint64_t written = 0;
  for (const TileId t : TileWriter::packOrder(keys, has_long)) {
    if (written % 256 == 0) step("packing", written, tiles.size());
    stack->write(t, tiles[t], writer);
    ++written;
  }
  tiles = {};
  keys = {};
  stack.reset();
  if (options.levels)
    writer.writeLevels(tiler.memoryForLevels(), threads,
                       [&](std::uint64_t done) { step("levels of detail", done, tile_count); });
  step("writing cells", 0, 0);
  writer.writeCells(tiler.records(), tiler.digests(), [&](const auto& use) { tiler.details(tile_of, use); });
  if (options.sections)
    for (const auto& [name, bytes] : options.sections()) writer.writeSection(name, bytes);

  IngestResult result;
  result.spool_bytes = tiler.spool_file_bytes();
  result.revision = writer.finish(options.provenance ? options.provenance() : Provenance{});
  result.counts = writer.counts();
  result.bytes = writer.bytes();
  step("publishing", 0, 0);
  result.unchanged = !set_folder.publish(result.revision);
  return result;
}

}  // namespace filiform
