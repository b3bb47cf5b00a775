#include "index/ingest/internal/make_set.h"

#include "index/errors.h"
#include "index/ingest/ranks/internal/rank_packs.h"
#include "index/ingest/tiling/internal/tile_packer.h"
#include "index/ingest/tiling/internal/tile_writer.h"
#include "index/internal/heap.h"
#include "index/levels/internal/level_blocks.h"
#include "index/levels/internal/level_writer.h"
#include "index/levels/internal/somata_section.h"

#include <algorithm>
#include <memory>
#include <optional>
#include <thread>
#include <utility>

namespace filiform::internal {
namespace {

constexpr unsigned kMostIngestThreads = 256;
constexpr std::uint64_t kLevelTiles = 128;                          // full tiles below a level tile, at least
constexpr std::uint64_t kMemoryOfThread = std::uint64_t{16} << 20;  // stack, buffers, arena and a tile at work

std::uint64_t leastSegments(const IngestOptions& options) { return kLevelTiles * std::uint64_t{options.capacity}; }

std::uint64_t encodedMemory(const IngestOptions& options) {
  return options.chunk_segments != 0 ? 0 : options.memory / 8;
}

TilerOptions tilerOptionsOf(const IngestOptions& options, unsigned threads, const std::string& folder) {
  return {.grid = Grid(options.quantum_exponent),
          .capacity = options.capacity,
          .memory = options.memory,
          .beside = options.stream_bytes,
          .reading = options.reading_bytes,
          .chunk_segments = options.chunk_segments,
          .threads = threads,
          .folder = folder,
          .ranks = options.ranks,
          .cancel = options.cancel,
          .progress = stepOf(options)};
}

TilePacker::Options packerOptionsOf(const IngestOptions& options, unsigned threads, const std::string& folder,
                                    const Tiler& tiler) {
  const Grid grid(options.quantum_exponent);
  std::vector<float> tolerances_um;
  if (options.levels)
    tolerances_um = leafTolerances_um(tiler.leaves(), tiler.midpoints(), leastSegments(options), grid, tiler.bounds());
  return {.grid = grid,
          .workers = threads,
          .folder = folder,
          .memory = encodedMemory(options),
          .tolerances_um = std::move(tolerances_um),
          .leaves = static_cast<std::uint32_t>(tiler.leaves().size())};
}

Provenance statedProvenance(const IngestOptions& options) {
  return options.provenance ? options.provenance() : Provenance{};
}

// The rest of the set, once all tiles are written; publishes it.
IngestResult completeSet(SetFolder& folder, const IngestOptions& options, Tiler& tiler,
                         std::unique_ptr<TilePacker> packer, TileWriter& writer, std::optional<Provenance> provenance) {
  const auto step = stepOf(options);
  step("choosing landmarks", 0, 0);
  writer.writeLandmarks(tiler.landmarks());
  const std::vector<TileId> tile_of = packer->tile_of();
  IngestResult result;
  if (options.levels) {
    packer->closeNeurites();
    LevelInput input;
    input.neurites = [&](TileId t) { return packer->neurites(t); };
    input.points = [&](TileId t) { return packer->neurite_points(t); };
    input.somata = tiler.somata();
    input.progress = [&](std::uint64_t done) { step("levels of detail", done, writer.tiles()); };
    LevelOptions level_options = tiler.optionsForLevels();
    level_options.least_segments = leastSegments(options);
    writer.writeLevels(std::move(input), std::move(level_options));
  }
  packer.reset();
  step("writing cells", 0, 0);
  writer.writeCells(tiler.records(), tiler.digests(), [&](const auto& use) { tiler.details(tile_of, use); });
  if (!tiler.somata().empty()) writer.writeSection(kSomataSection, encodeSomata(tiler.somata()));
  if (!tiler.attributes().empty())
    writer.writeSection(kAttributesSection,
                        tiler.attributes().encode(static_cast<std::uint32_t>(tiler.records().size())));
  if (options.sections)
    for (const auto& [name, bytes] : options.sections()) writer.writeSection(name, bytes);

  result.spool_bytes = tiler.spool_file_bytes();
  if (!provenance) provenance = statedProvenance(options);
  result.revision = writer.finish(*provenance);
  result.counts = writer.counts();
  result.bytes = writer.bytes();
  step("publishing", 0, 0);
  result.unchanged = !folder.publish(result.revision);
  return result;
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

Step stepOf(const IngestOptions& options) {
  return [&options](const char* phase, std::uint64_t done, std::uint64_t total) {
    if (options.cancel != nullptr && options.cancel->load(std::memory_order_relaxed)) throw Interrupted("interrupted");
    if (options.progress) options.progress(phase, done, total);
  };
}

IngestResult makeSet(SetFolder* folder, const std::string& building, const IngestOptions& options,
                     const std::function<void(Tiler&)>& read) {
  const unsigned threads = checkedThreads(options);
  Ranks* const ranks = options.ranks != nullptr && options.ranks->count() > 1 ? options.ranks : nullptr;
  unmapLargeBlocksWhenFreed();
  Tiler tiler(tilerOptionsOf(options, threads, building));
  read(tiler);
  std::optional<Provenance> provenance;
  if (ranks != nullptr) provenance = statedProvenance(options);  // all ranks together
  tiler.cut();
  const auto leaves = static_cast<std::uint32_t>(tiler.leaves().size());
  TilePacker::Options packing = packerOptionsOf(options, threads, building, tiler);
  const auto packsOf = [&](TilePacker& packer) {
    return RankPacks{*ranks, packer, building, options.pack_bytes, encodedMemory(options), leaves, options.levels};
  };
  if (folder == nullptr) {
    std::optional<RankPacker> together;
    packing.hold = true;
    TilePacker packer(std::move(packing),
                      [&](const TileEntry& entry, std::uint32_t leaf, ByteSpan geometry, ByteSpan appearance) {
                        together->add(entry, leaf, geometry, appearance);
                      });
    tiler.tiles(packer);
    together.emplace(packsOf(packer));
    together->run();
    ranks->share({});  // rank 0 publishes before
    return {};
  }
  TileWriter writer(building, Grid(options.quantum_exponent), options.capacity, options.pack_bytes,
                    {options.page_tiles, options.group_pages});
  writer.reserve(leaves + std::size_t{1});
  auto packer = std::make_unique<TilePacker>(
      std::move(packing), [&](const TileEntry& entry, std::uint32_t leaf, ByteSpan geometry, ByteSpan appearance) {
        writer.add(entry, geometry, appearance, leaf == leaves);
      });
  tiler.tiles(*packer);
  if (ranks != nullptr) packTogether(packsOf(*packer), writer);
  IngestResult result = completeSet(*folder, options, tiler, std::move(packer), writer, std::move(provenance));
  if (ranks != nullptr) ranks->share({});
  return result;
}

}  // namespace filiform::internal
