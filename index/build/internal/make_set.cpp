#include "index/build/internal/make_set.h"

#include "index/build/internal/heap.h"
#include "index/build/internal/level_blocks.h"
#include "index/build/internal/level_writer.h"
#include "index/build/internal/somata_section.h"
#include "index/build/internal/tile_stack.h"
#include "index/build/internal/tile_writer.h"
#include "index/errors.h"

#include <algorithm>
#include <memory>
#include <thread>
#include <utility>

namespace filiform::internal {
namespace {

constexpr unsigned kMostIngestThreads = 256;
constexpr std::uint64_t kLevelTiles = 128;                          // full tiles below a level tile, at least
constexpr std::uint64_t kMemoryOfThread = std::uint64_t{16} << 20;  // stack, buffers, arena and a tile at work

GridBox boundsOf(const std::vector<CellRecord>& cells) {
  GridBox bounds;
  for (const CellRecord& cell : cells)
    if (!cell.bounds.empty()) bounds.extend(cell.bounds);
  return bounds;
}

}  // namespace

std::string folderName(const std::string& path) {
  std::string folder = path;
  while (folder.size() > 1 && folder.back() == '/') folder.pop_back();
  return folder;
}

unsigned checkedThreads(const IngestOptions& options) {
  if (options.capacity == 0) throw UsageError("the capacity of a tile must be at least 1");
  if (options.quantum_exponent < Grid::kMinExponent || options.quantum_exponent > Grid::kMaxExponent)
    throw UsageError("the quantum must be a power of two from 2^-10 to 2^10 um");
  if (options.memory < kMinIngestMemory)
    throw UsageError("ingest needs at least " + std::to_string(kMinIngestMemory >> 20) + " MiB of memory");
  const unsigned wanted = options.threads != 0 ? options.threads : std::max(1u, std::thread::hardware_concurrency());
  return static_cast<unsigned>(std::min<std::uint64_t>({wanted, kMostIngestThreads, options.memory / kMemoryOfThread}));
}

std::function<void(const char*, std::uint64_t, std::uint64_t)> stepOf(const IngestOptions& options) {
  return [&options](const char* phase, std::uint64_t done, std::uint64_t total) {
    if (options.cancel != nullptr && options.cancel->load(std::memory_order_relaxed)) throw Interrupted("interrupted");
    if (options.progress) options.progress(phase, done, total);
  };
}

IngestResult makeSet(SetFolder& folder, const IngestOptions& options, const std::function<void(Tiler&)>& read) {
  const unsigned threads = checkedThreads(options);
  const auto step = stepOf(options);
  unmapLargeBlocksWhenFreed();
  const Grid grid(options.quantum_exponent);
  Tiler tiler({.grid = grid,
               .capacity = options.capacity,
               .memory = options.memory,
               .beside = options.stream_bytes,
               .reading = options.reading_bytes,
               .chunk_segments = options.chunk_segments,
               .threads = threads,
               .folder = folder.building(),
               .cancel = options.cancel,
               .progress = step});
  read(tiler);
  tiler.cut();
  const std::uint64_t least_segments = kLevelTiles * std::uint64_t{options.capacity};
  std::vector<float> tolerances_um;
  if (options.levels)
    tolerances_um =
        leafTolerances_um(tiler.leaves(), tiler.midpoints(), least_segments, grid, boundsOf(tiler.records()));
  auto stack = std::make_unique<TileStack>(
      grid, threads, folder.building(), options.chunk_segments != 0 ? 0 : options.memory / 8, std::move(tolerances_um));
  tiler.tiles(*stack);
  std::vector<TileStack::Encoded> tiles = stack->finish();

  const auto leaf_count = static_cast<std::uint32_t>(tiler.leaves().size());
  const bool has_long = !tiles.empty() && tiles.back().leaf == leaf_count;
  TileWriter writer(folder.building(), grid, options.capacity, static_cast<TileId>(tiles.size()), has_long,
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
  IngestResult result;
  std::uint64_t written = 0;
  for (const TileId t : TileWriter::packOrder(keys, has_long)) {
    if (written % 256 == 0) step("packing", written, tiles.size());
    stack->write(t, tiles[t], writer);
    ++written;
  }
  keys = {};
  if (options.levels) {
    LevelInput input;
    std::vector<std::uint32_t> segments;
    for (const TileStack::Encoded& tile : tiles)
      if (tile.leaf < leaf_count) segments.push_back(tile.entry.owned);
    input.segments = segments;
    input.neurites = [&](TileId t) { return stack->neurites(tiles[t]); };
    input.points = [&](TileId t) { return tiles[t].neurite_points; };
    input.somata = tiler.somata();
    input.progress = [&](std::uint64_t done) { step("levels of detail", done, tile_count); };
    LevelOptions level_options = tiler.optionsForLevels();
    level_options.least_segments = least_segments;
    writer.writeLevels(std::move(input), std::move(level_options));
  }
  tiles = {};
  stack.reset();
  step("writing cells", 0, 0);
  writer.writeCells(tiler.records(), tiler.digests(), [&](const auto& use) { tiler.details(tile_of, use); });
  if (!tiler.somata().empty()) writer.writeSection(kSomataSection, encodeSomata(tiler.somata()));
  if (!tiler.attributes().empty())
    writer.writeSection(kAttributesSection,
                        tiler.attributes().encode(static_cast<std::uint32_t>(tiler.records().size())));
  if (options.sections)
    for (const auto& [name, bytes] : options.sections()) writer.writeSection(name, bytes);

  result.spool_bytes = tiler.spool_file_bytes();
  result.revision = writer.finish(options.provenance ? options.provenance() : Provenance{});
  result.counts = writer.counts();
  result.bytes = writer.bytes();
  step("publishing", 0, 0);
  result.unchanged = !folder.publish(result.revision);
  return result;
}

}  // namespace filiform::internal
