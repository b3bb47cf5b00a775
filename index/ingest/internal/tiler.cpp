#include "index/ingest/internal/tiler.h"

#include "index/errors.h"
#include "index/ingest/ranks/internal/rank_steps.h"
#include "index/ingest/tiling/internal/border_segments.h"
#include "index/ingest/tiling/internal/cell_leaves.h"
#include "index/ingest/tiling/internal/cell_reading.h"
#include "index/ingest/tiling/internal/chunks.h"
#include "index/ingest/tiling/internal/crowded_leaves.h"
#include "index/ingest/tiling/internal/leaf_builder.h"
#include "index/ingest/tiling/internal/survey_runs.h"
#include "index/internal/heap.h"
#include "index/internal/memory_budget.h"
#include "index/workers.h"

#include <algorithm>
#include <cassert>
#include <mutex>
#include <numeric>
#include <optional>
#include <tuple>

namespace filiform::internal {
namespace {

constexpr std::uint64_t kMostChunkSegments = std::uint64_t{1} << 17;  // larger chunks are slower
constexpr std::uint64_t kSmallMemory = std::uint64_t{512} << 20;
constexpr std::uint64_t kMostMemory = std::uint64_t{1} << 56;  // keeps sums of shares from overflowing

// Bytes for items that grow with the data. Measured with margins, since vectors grow by halves.
constexpr std::uint64_t kBytesOfChunk = 640, kBytesOfBlock = 56;
constexpr std::uint64_t kBytesOfLeaf = 320;     // while tiles are made and packed
constexpr std::uint64_t kBytesOfCut = 40;       // of a segment whose chunk is cut into leaves
constexpr std::uint64_t kBytesOfSegment = 160;  // of a segment whose chunk is made into tiles, as a rule
constexpr std::uint64_t kBytesOfLandmark = 160;

}  // namespace

struct Tiler::Impl {
  explicit Impl(TilerOptions given);
  static std::uint64_t mostInChunk(const TilerOptions& options);

  static constexpr std::uint32_t kNone = UINT32_MAX;

  void stopIfCancelled() const {
    if (options.cancel != nullptr && options.cancel->load(std::memory_order_relaxed)) throw Interrupted("interrupted");
  }
  void step(const char* phase, std::uint64_t done, std::uint64_t total) const {
    stopIfCancelled();
    if (options.progress) options.progress(phase, done, total);
  }

  void endReading();
  std::vector<BlockKey> findLeaves(std::vector<SegmentChain>& crossing);
  std::span<Chunk> own() { return std::span(chunks).subspan(own_begin, own_end - own_begin); }
  std::uint64_t allSegments() const { return together ? totals.segments : intake.segments(); }
  LeafBuilder builder(unsigned worker, TileSink& sink);
  static LeafBuilder::Range rangeOf(const Chunk& chunk) { return {chunk.first_leaf, chunk.end_leaf, chunk.core()}; }
  void refuseCrowdedLeaves(std::span<SegmentChain> crossing);
  void refuseWhatCannotBeBuilt();
  void refuseLongSegments(std::uint64_t count) const;
  void writeLongTile(TileSink& sink);
  void handOver(LeafContent& content, unsigned worker, TileSink& sink);
  template <typename Work>  // work(chunk, worker, hold); free(worker): gives up the memory of a worker
  void forEachChunk(
      const char* phase, const Work& work, const std::function<void(unsigned)>& free = [](unsigned) {});
  // Shares of the memory: a quarter for the spool's blocks, a sixteenth for its open buffers, an eighth for encoded
  // tiles that wait, and neurites (tile_packer.h). The rest is for chunks at work and for data that grow with the
  // number of cells, chunks and leaves.
  std::uint64_t grown() const {
    return options.beside + options.reading + intake.bytes() + (table.size() + blocks_read) * kBytesOfChunk +
           spool.blocks() * kBytesOfBlock + partition.leaves().size() * kBytesOfLeaf +
           landmarksFor(allSegments()) * kBytesOfLandmark;
  }
  std::uint64_t workBytes() const {
    const std::uint64_t most = options.memory / 16 * 9;
    return most - std::min(most, grown());
  }
  // What grows may grow a little more before the work is done.
  std::uint64_t memoryForWork(std::uint64_t bytes) const { return (bytes + grown() + grown() / 8) / 9 * 16 + 16; }
  // Throws if less than an eighth remains to work with.
  void refuseWhatHasGrown() const;

  TilerOptions options;
  std::uint64_t most_in_chunk;
  Spool spool;
  std::size_t most_open;  // chunks that have a buffer
  Chunks table;
  std::vector<Chunk>& chunks = table.all();
  std::size_t own_begin = 0, own_end = 0;  // of the chunks: those of this rank

  std::size_t blocks_read = 0;  // of segments, while cells are read
  CellIntake intake;
  std::uint64_t visited = 0;

  LandmarkSurvey survey;
  Partition partition{std::vector<BlockKey>{BlockKey{}}};
  std::vector<std::uint32_t> midpoints;      // by leaf
  std::vector<SegmentChain> long_segments;   // by worker
  std::vector<LandmarkChooser::Part> parts;  // by worker
  std::unique_ptr<const LandmarkChooser> chooser;
  std::unique_ptr<CellLeaves> cell_leaves;  // of rank 0

  std::optional<RankSteps> together;  // with several ranks
  RankSteps::Totals totals;
  std::vector<ByteChain> pairs;  // of cell and leaf, by worker; of other ranks
};

// All threads at work take a third. A chunk with no more ghosts than segments of its own never has a tile that is too
// large to be built. Only a chunk with more midpoints than a leaf may hold is split.
std::uint64_t Tiler::Impl::mostInChunk(const TilerOptions& options) {
  const std::uint64_t most = options.chunk_segments != 0
                                 ? options.chunk_segments
                                 : std::min({kMostChunkSegments, options.memory / 3 / kBytesOfSegment / options.threads,
                                             options.memory / 4 / LeafBuilder::tileCost(1)});
  return std::max<std::uint64_t>(most, options.capacity);
}

Tiler::Impl::Impl(TilerOptions given)
    : options(std::move(given)),
      most_in_chunk(mostInChunk(options)),
      spool(options.folder,
            options.folder.empty() || options.memory < kSmallMemory ? std::size_t{16} << 10 : std::size_t{64} << 10,
            options.chunk_segments != 0 ? 0 : options.memory / 4),
      most_open(std::max<std::size_t>(Chunks::kLeastOpen, options.memory / 16 / spool.block_bytes())),
      table(spool, most_in_chunk, most_open),
      intake(spool) {
  options.memory = std::min(options.memory, kMostMemory);
  if (options.ranks != nullptr && options.ranks->count() > 1) {
    together.emplace(*options.ranks, spool);
    if (!together->isFirst()) intake.keepForOthers();
  }
  parts.resize(options.threads);
  for (unsigned i = 0; i < options.threads; ++i) long_segments.emplace_back(spool);
}

void Tiler::Impl::refuseWhatHasGrown() const {
  if (workBytes() >= options.memory / 8) return;
  throw InputError(std::to_string(intake.records().size()) + " cells and " + std::to_string(partition.leaves().size()) +
                   " tiles take more memory than is given; ingest with --memory " +
                   std::to_string((grown() / 7 * 16 >> 20) + 1) + "MiB or more");
}

template <typename Work>
void Tiler::Impl::forEachChunk(const char* phase, const Work& work, const std::function<void(unsigned)>& free) {
  std::atomic<std::size_t> next{0};
  std::atomic<std::uint64_t> done{0};
  const std::span<Chunk> those = own();
  std::uint64_t all = 0;
  for (const Chunk& chunk : those) all += chunk.own.count();
  MemoryBudget budget(std::max(workBytes(), options.memory / 8), options.threads);
  const std::size_t threads = std::clamp<std::size_t>(those.size(), 1, options.threads);
  runWorkers(threads, [&](unsigned worker, const std::atomic<bool>& failed) {
    MemoryBudget::Hold hold(budget);
    for (std::size_t i; !failed && (i = next.fetch_add(1)) < those.size();) {
      worker == 0 ? step(phase, done, all) : stopIfCancelled();
      Chunk& chunk = those[i];
      const std::uint64_t n = chunk.own.count();
      work(chunk, worker, hold);
      done += n;
    }
    free(worker);
  });
  stopIfCancelled();
}

void Tiler::Impl::handOver(LeafContent& content, unsigned worker, TileSink& sink) {
  constexpr std::size_t kKept = std::size_t{1} << 16;  // a larger vector is freed after use
  std::uint32_t cell = kNone;
  for (const StoredSegment& segment : content.segments) {
    if (!segment.owned || segment.id.cell == cell) continue;
    cell = segment.id.cell;
    if (cell_leaves) {
      cell_leaves->add(worker, cell, content.leaf);
    } else {
      ByteWriter pair;
      pair.u32(cell);
      pair.u32(content.leaf);
      pairs[worker].append(pair.bytes());
    }
  }
  chooser->addLeaf(content.key, content.segments, parts[worker]);
  sink.add(worker, content);
  if (content.segments.capacity() > kKept) content.segments = {};
}

LeafBuilder Tiler::Impl::builder(unsigned worker, TileSink& sink) {
  LeafBuilder made(partition, spool, long_segments[worker], options.capacity,
                   [this, worker, &sink](LeafContent& content) {
                     stopIfCancelled();
                     handOver(content, worker, sink);
                   });
  made.memoryFor = [this](std::uint64_t bytes) { return memoryForWork(bytes); };
  return made;
}

// Refuses if one tile with many ghosts exceeds the memory. A sample usually shows this before the ghosts are given to
// their chunks, which takes most of the time.
void Tiler::Impl::refuseCrowdedLeaves(std::span<SegmentChain> crossing) {
  CrowdedLeaves crowded(partition, crossing, [this] { stopIfCancelled(); });
  std::uint64_t stored = 0;
  if (LeafBuilder::tileCost(crowded.estimate()) > workBytes())
    stored = crowded.count([this](std::uint32_t leaf) {
      Chunk& chunk = chunks[table.ofLeaf(leaf)];
      return CrowdedLeaves::Chunk{&chunk.own, closedBlock(chunk.key)};
    });
  visited += crowded.visited();
  if (LeafBuilder::tileCost(stored) > workBytes())
    LeafBuilder::refuse(stored, memoryForWork(LeafBuilder::tileCost(stored)));
}

// Counts exactly what could be too much, before any tile is made.
void Tiler::Impl::refuseWhatCannotBeBuilt() {
  std::atomic<std::uint64_t> largest{0}, too_long{0};
  forEachChunk("counting", [&](Chunk& chunk, unsigned worker, MemoryBudget::Hold& hold) {
    const std::uint64_t own = chunk.own.count(), ghosts = chunk.ghosts.count();
    if (LeafBuilder::tileCost(own + ghosts) <= hold.budget().limit()) return;
    if (ghosts <= own && own <= most_in_chunk && LeafBuilder::tileCost(2 * most_in_chunk) <= hold.budget().limit())
      return;
    LeafBuilder counter(partition, spool, long_segments[worker], options.capacity, {});
    SegmentChain* const chains[] = {&chunk.own, &chunk.ghosts};
    const LeafBuilder::Counts counts = counter.count(chains, rangeOf(chunk));
    const std::uint64_t stored = *std::max_element(counts.stored.begin(), counts.stored.end());
    for (std::uint64_t before = largest; stored > before && !largest.compare_exchange_weak(before, stored);) {
    }
    too_long += std::accumulate(counts.too_long.begin(), counts.too_long.end(), std::uint64_t{0});
    refuseLongSegments(too_long);
  });
  if (LeafBuilder::tileCost(largest) > workBytes())
    LeafBuilder::refuse(largest, memoryForWork(LeafBuilder::tileCost(largest)));
}

void Tiler::Impl::refuseLongSegments(std::uint64_t count) const {
  if (LeafBuilder::tileCost(count) <= workBytes()) return;
  throw InputError(std::to_string(count) + " segments meet more than " + std::to_string(kMaxLeavesOfSegment) +
                   " tiles each and belong to one tile, which takes more memory than is given; ingest with a larger "
                   "--capacity, or with --memory " +
                   std::to_string((memoryForWork(LeafBuilder::tileCost(count)) >> 20) + 1) + "MiB");
}

void Tiler::Impl::writeLongTile(TileSink& sink) {
  std::uint64_t count = 0;
  for (SegmentChain& chain : long_segments) {
    chain.close();
    count += chain.count();
  }
  if (count == 0) return;
  refuseLongSegments(count);
  std::vector<SegmentRecord> records;
  records.reserve(count);
  for (SegmentChain& chain : long_segments) {
    SegmentChain::Reader reader(chain, true);
    for (SegmentRecord record = SegmentChain::first(); reader.next(record);) records.push_back(record);
  }
  std::sort(records.begin(), records.end(), [](const SegmentRecord& a, const SegmentRecord& b) { return a.id < b.id; });
  LeafContent content;
  content.leaf = static_cast<std::uint32_t>(partition.leaves().size());
  content.is_long = true;
  content.fill(
      count, [&](std::size_t i) -> const SegmentRecord& { return records[i]; }, [](std::size_t) { return true; });
  records = {};
  sink.begin(0, content.leaf);
  handOver(content, 0, sink);
  sink.end(0, content.leaf + 1);
}

Tiler::Tiler(TilerOptions options) : impl_(std::make_unique<Impl>(std::move(options))) {}
Tiler::~Tiler() = default;

void Tiler::read(CellStream& stream) {
  Impl& t = *impl_;
  std::optional<Chunks> read;
  if (t.together) read.emplace(t.spool, t.most_in_chunk, t.most_open);
  const auto check = [&t](std::size_t blocks) {
    t.blocks_read = blocks;
    t.refuseWhatHasGrown();
  };
  const CellReading reading{.grid = t.options.grid,
                            .most_in_chunk = t.most_in_chunk,
                            .most_open = t.most_open,
                            .threads = t.options.threads,
                            .progress = [&t](std::uint64_t segments) { t.step("reading", segments, 0); },
                            .check = check};
  readCells(stream, reading, t.spool, t.intake, read ? *read : t.table, t.survey);
  t.blocks_read = 0;
  if (t.together) {
    t.step("exchanging segments", 0, 0);
    t.totals = t.together->total(t.intake);
    t.together->distribute(*read, t.table, t.totals.first_cell, t.options.capacity,
                           [&t](std::uint64_t moved) { t.step("exchanging segments", moved, 0); });
    read.reset();
    t.together->gatherCells(t.intake);
  }
  t.endReading();
}

void Tiler::read(const StoredCells& cells) {
  Impl& t = *impl_;
  for (std::uint32_t c = 0; c < cells.size(); ++c) {
    if (c % 256 == 0) t.refuseWhatHasGrown();
    t.intake.take(cells.cell(c));
  }
  std::uint64_t done = 0;
  cells.forEachSegment([&](const SegmentRecord& record) {
    if (done++ % 65536 == 0) t.step("reading the set", done, t.intake.segments());
    t.survey.addLength(record.child, record.parent);
    t.table.add(record);
  });
  t.endReading();
}

void Tiler::Impl::endReading() {
  options.reading = 0;
  std::atomic<std::uint64_t> sorted{0};
  // Until chunks are at work, their memory is free.
  table.settle(options.threads, 4 * most_open, [&](unsigned worker, std::uint64_t moved) {
    sorted += moved;
    worker == 0 ? step("sorting", sorted, 0) : stopIfCancelled();
  });
  own_end = chunks.size();
  intake.finish();
  refuseWhatHasGrown();
  for (const Chunk& chunk : chunks)
    if (chunk.own.count() > most_in_chunk && LeafBuilder::tileCost(chunk.own.count()) > workBytes())
      throw InputError(
          std::to_string(chunk.own.count()) +
          " segments have the same midpoint and belong to one tile, which takes more memory than is given; "
          "ingest with --memory " +
          std::to_string((memoryForWork(LeafBuilder::tileCost(chunk.own.count())) >> 20) + 1) + "MiB");
}

// The leaves of all chunks, ascending; `crossing` gets the segments that touch borders of chunks.
std::vector<BlockKey> Tiler::Impl::findLeaves(std::vector<SegmentChain>& crossing) {
  std::vector<CutLeaves> leaves_of(chunks.size());
  std::vector<CutWork> work(options.threads);
  SurveyRuns surveys;
  std::mutex mutex;
  std::uint64_t leaf_count = 0;
  forEachChunk("cutting", [&](Chunk& chunk, unsigned worker, MemoryBudget::Hold& hold) {
    const std::uint64_t bytes = std::min(chunk.own.count() * kBytesOfCut, hold.budget().limit());
    if (!hold.fits(bytes)) hold.wait(bytes);
    const auto self = static_cast<std::size_t>(&chunk - chunks.data());
    LandmarkSurvey found;
    leaves_of[self] = cutChunk(chunk, options.capacity, found, crossing[worker], work[worker]);
    const std::lock_guard lock(mutex);
    surveys.add(self, std::move(found));
    leaf_count += leaves_of[self].keys.size();
    if (leaf_count * kBytesOfLeaf > options.memory)
      throw InputError("the segments need more than " + std::to_string(leaf_count) +
                       " tiles, which takes more memory than is given; ingest with a larger --capacity, or with "
                       "--memory " +
                       std::to_string((leaf_count * kBytesOfLeaf * 2 >> 20) + 1) + "MiB or more");
  });
  surveys.addTo(survey);
  std::vector<BlockKey> leaves;
  leaves.reserve(leaf_count);
  midpoints.reserve(leaf_count);
  for (std::size_t c = 0; c < chunks.size(); ++c) {
    chunks[c].first_leaf = static_cast<std::uint32_t>(leaves.size());
    leaves.insert(leaves.end(), leaves_of[c].keys.begin(), leaves_of[c].keys.end());
    midpoints.insert(midpoints.end(), leaves_of[c].midpoints.begin(), leaves_of[c].midpoints.end());
    chunks[c].end_leaf = static_cast<std::uint32_t>(leaves.size());
    leaves_of[c] = {};
  }
  if (!together) return leaves;
  survey = together->shareSurvey(survey);
  leaves = together->shareLeaves(leaves, midpoints);
  std::tie(own_begin, own_end) = together->addOtherChunks(chunks);
  return leaves;
}

void Tiler::cut() {
  Impl& t = *impl_;
  std::vector<SegmentChain> crossing;
  for (unsigned i = 0; i < t.options.threads; ++i) crossing.emplace_back(t.spool);
  t.partition = Partition(t.findLeaves(crossing));
  t.refuseWhatHasGrown();
  const std::uint64_t packing = t.options.beside + t.intake.bytes() + leaves().size() * kBytesOfLeaf,
                      free = t.options.memory / 8 * 7;
  if (packing > free)
    throw InputError(std::to_string(leaves().size()) + " tiles take more memory than is given; ingest with --memory " +
                     std::to_string((packing / 7 * 8 >> 20) + 1) + "MiB");
  for (SegmentChain& chain : crossing) chain.close();
  t.step("counting", 0, 0);
  t.refuseCrowdedLeaves(crossing);
  std::atomic<std::uint64_t> delivered{0};
  BorderSegments border(t.table, t.partition, t.spool,
                        {t.most_open, t.options.threads, [&](unsigned worker, std::uint64_t segments) {
                           delivered += segments;
                           worker == 0 ? t.step("counting", delivered, 0) : t.stopIfCancelled();
                         }});
  border.deliver(crossing);
  if (t.together) {
    SegmentChain ghosts(t.spool);
    t.together->exchangeGhosts(t.chunks, ghosts);
    border.deliver(ghosts, t.own_begin, t.own_end);
  }
  t.visited += border.visited();
  t.refuseWhatCannotBeBuilt();
}

void Tiler::tiles(TileSink& sink) {
  Impl& t = *impl_;
  t.chooser = std::make_unique<const LandmarkChooser>(t.options.grid, t.survey, landmarksFor(t.allSegments()));
  if (t.together && !t.together->isFirst()) {
    for (unsigned i = 0; i < t.options.threads; ++i) t.pairs.emplace_back(t.spool);
  } else {
    t.cell_leaves =
        std::make_unique<CellLeaves>(t.intake.records(), t.options.threads, t.options.folder,
                                     t.options.chunk_segments != 0 ? 0 : t.options.memory / 64, t.options.memory / 8);
  }

  std::atomic<std::uint64_t> too_long{0};
  std::vector<LeafBuilder> builders;
  builders.reserve(t.options.threads);
  for (unsigned i = 0; i < t.options.threads; ++i) builders.push_back(t.builder(i, sink));
  t.forEachChunk(
      "writing tiles",
      [&](Chunk& chunk, unsigned worker, MemoryBudget::Hold& hold) {
        SegmentChain* const chains[] = {&chunk.own, &chunk.ghosts};
        const std::uint64_t before = t.long_segments[worker].count();
        sink.begin(worker, chunk.first_leaf);
        builders[worker].build(chains, Impl::rangeOf(chunk), hold);
        sink.end(worker, chunk.end_leaf);
        if (const std::uint64_t more = t.long_segments[worker].count() - before; more > 0)
          t.refuseLongSegments(too_long += more);
      },
      [&](unsigned worker) { builders[worker].release(); });
  for (const LeafBuilder& builder : builders) t.visited += builder.visited();
  builders.clear();

  if (t.together) t.together->gatherLong(t.long_segments);
  if (!t.together || t.together->isLast()) t.writeLongTile(sink);
  if (t.together)
    t.together->gatherFound(t.pairs, t.parts,
                            [&t](std::uint32_t cell, std::uint32_t leaf) { t.cell_leaves->add(0, cell, leaf); });
  if (t.cell_leaves) t.cell_leaves->close();
  t.spool.trim();
}

Landmarks Tiler::landmarks() { return impl_->chooser->finish(impl_->parts); }

void Tiler::details(std::span<const TileId> tile_of, const std::function<void(ByteSpan detail)>& use) {
  Impl& t = *impl_;
  t.intake.readDetails([&](std::uint32_t cell, ByteSpan detail) {
    if (t.cell_leaves->startsGroup(cell)) t.step("writing cells", cell, t.intake.records().size());
    const std::span<const std::uint32_t> owners = t.cell_leaves->next(cell);
    ByteWriter out;
    out.varint(owners.size());
    TileId last = 0;
    for (const std::uint32_t leaf : owners) {
      const TileId tile = tile_of[leaf];
      out.varint(tile - last);
      last = tile;
    }
    out.append(detail);
    use(out.bytes());
  });
}

LevelOptions Tiler::optionsForLevels() {
  Impl& t = *impl_;
  constexpr std::uint64_t kShares = 16, kForDetails = 1, kForLevels = 13;  // of 16; 2 are for neurites
  t.intake.limitDetails(t.options.memory / kShares * kForDetails);
  returnFreedMemory();
  const std::uint64_t most = t.options.memory / kShares * kForLevels,
                      held = t.options.beside + t.intake.bytes() + leaves().size() * kBytesOfLeaf;
  LevelOptions options;
  options.threads = t.options.threads;
  options.memory = most - std::min(most, held);
  options.memoryFor = [held](std::uint64_t bytes) { return (bytes + held) / kForLevels * kShares + kShares; };
  return options;
}

const std::vector<BlockKey>& Tiler::leaves() const { return impl_->partition.leaves(); }
const std::vector<std::uint32_t>& Tiler::midpoints() const { return impl_->midpoints; }
const std::vector<SomaRoot>& Tiler::somata() const { return impl_->intake.somata(); }
const AttributeTable& Tiler::attributes() const { return impl_->intake.attributes(); }
const std::vector<CellRecord>& Tiler::records() const { return impl_->intake.records(); }
const std::vector<std::uint64_t>& Tiler::digests() const { return impl_->intake.digests(); }
std::uint64_t Tiler::segments() const { return impl_->allSegments(); }
GridBox Tiler::bounds() const { return impl_->together ? impl_->totals.bounds : impl_->intake.bounds(); }
std::uint32_t Tiler::first_leaf() const { return impl_->together ? impl_->together->first_leaf() : 0; }
std::uint64_t Tiler::spool_file_bytes() const { return impl_->spool.file_bytes(); }
std::size_t Tiler::chunks() const { return impl_->chunks.size(); }
std::uint64_t Tiler::visited() const { return impl_->visited; }

}  // namespace filiform::internal
