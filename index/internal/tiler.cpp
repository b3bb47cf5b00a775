#include "index/internal/tiler.h"

#include "index/errors.h"
#include "index/internal/key_sort.h"
#include "index/internal/leaf_builder.h"
#include "index/internal/memory_gate.h"
#include "index/internal/set_files.h"

#include <algorithm>
#include <cassert>
#include <exception>
#include <mutex>
#include <numeric>
#include <system_error>
#include <thread>

namespace filiform::internal {
namespace {

constexpr std::uint64_t kMostChunkSegments = std::uint64_t{1} << 19;  // more is no faster
constexpr std::uint64_t kSmallMemory = std::uint64_t{512} << 20;
constexpr std::uint64_t kMostMemory = std::uint64_t{1} << 56;  // so that sums of shares do not overflow
constexpr std::uint64_t kPairsPerGroup = std::uint64_t{1} << 22;
constexpr std::size_t kPairBlock = std::size_t{4} << 10;
constexpr std::size_t kMostSamplesKept = std::size_t{1} << 16;  // of a cell, in arrays that the next one uses again

// What takes memory in proportion to its number, bytes. Measured with margins: vectors grow by halves.
constexpr std::uint64_t kBytesOfChunk = 640, kBytesOfBlock = 56;
constexpr std::uint64_t kBytesOfCell = 512;        // names beside
constexpr std::uint64_t kBytesOfLeaf = 512;        // while tiles are made
constexpr std::uint64_t kBytesOfPackedLeaf = 900;  // while they are packed
constexpr std::uint64_t kBytesOfCut = 40;          // of a segment whose chunk is cut into leaves
constexpr std::uint64_t kBytesOfSegment = 160;     // of a segment whose chunk is made into tiles, as a rule

std::uint64_t heapBytes(const std::string& text) { return text.size() < 16 ? 0 : text.size() + 32; }

bool contains(const GridBox& box, const GridPoint& p) {
  return (p.array() >= box.lo.array()).all() && (p.array() <= box.hi.array()).all();
}

// Does the segment meet no closed cell but this one's?
bool strictlyInside(const GridBox& closed, const GridPoint& a, const GridPoint& b) {
  return (a.array() > closed.lo.array()).all() && (a.array() < closed.hi.array()).all() &&
         (b.array() > closed.lo.array()).all() && (b.array() < closed.hi.array()).all();
}

}  // namespace

struct Tiler::Impl {
  explicit Impl(TilerOptions given);

  // A cell that segments are spooled to by their midpoints.
  struct Chunk {
    CellKey key;
    GridBox box;   // grid points of the cell
    GridBox seen;  // of the midpoints
    SegmentChain own, ghosts;
    std::uint32_t parent;  // in splits
    int side;
    std::uint32_t first_leaf = 0, end_leaf = 0;

    // The smallest cell that holds its midpoints: the chunk's may be far larger.
    CellKey core() const {
      CellKey cell = key;
      if (seen.empty()) return cell;
      const MortonKey low = mortonKey(seen.lo), high = mortonKey(seen.hi);  // keys rise with each coordinate
      while (cell.depth < kMortonBits && cell.half(0).contains(low) == cell.half(0).contains(high))
        cell = cell.half(cell.half(0).contains(low) ? 0 : 1);
      return cell;
    }
  };
  struct Split {
    std::int64_t plane;
    int axis;
    std::uint32_t child[2];  // in splits, or kChunkBit | in chunks
  };
  struct Remnant {  // what a chunk held when it was split
    SegmentChain chain;
    std::uint32_t split;
  };
  static constexpr std::uint32_t kChunkBit = std::uint32_t{1} << 31;
  static constexpr std::uint32_t kNone = UINT32_MAX;

  struct Pair {
    std::uint32_t cell, leaf;
  };

  void stopIfCancelled() const {
    if (options.cancel != nullptr && options.cancel->load(std::memory_order_relaxed)) throw Interrupted("interrupted");
  }
  void step(const char* phase, std::uint64_t done, std::uint64_t total) const {
    stopIfCancelled();
    if (options.progress) options.progress(phase, done, total);
  }

  void take(Cell& cell);
  std::uint32_t addChunk(const CellKey& key, std::uint32_t parent, int side);
  std::uint32_t chunkOf(std::uint32_t split, const GridPoint& middle) const;
  void put(std::uint32_t chunk, const SegmentRecord& record, const GridPoint& middle);
  void split(std::uint32_t chunk);
  void settle();
  void closeOpen();
  void settleRemnants(std::size_t from);
  void cutChunk(Chunk& chunk, SampleSurvey& survey, SegmentChain& crossing, std::vector<CellKey>& found) const;
  void deliver(SegmentChain& crossing, std::size_t begin, std::size_t end);
  LeafBuilder builder(unsigned worker, TileSink& sink);
  static LeafBuilder::Range rangeOf(const Chunk& chunk) { return {chunk.first_leaf, chunk.end_leaf, chunk.core()}; }
  void refuseWhatCannotBeBuilt();
  void handOver(std::uint32_t leaf, const CellKey& key, bool is_long, std::vector<StoredSegment>& stored,
                TileAppearance& appearance, unsigned worker, TileSink& sink);
  template <typename Work>  // work(chunk, worker, gate, pass); free(worker): gives up the memory of a worker
  void forEachChunk(
      const char* phase, const Work& work, const std::function<void(unsigned)>& free = [](unsigned) {});
  std::size_t group(std::uint32_t cell) const {
    return static_cast<std::size_t>(std::upper_bound(group_begin.begin(), group_begin.end(), cell) -
                                    group_begin.begin() - 1);
  }

  // Shares of the memory: a quarter for the spool's blocks, a sixteenth for its open buffers, an eighth for the encoded
  // tiles (ingest.cpp), the rest for chunks at work and for what grows with the number of cells, chunks and leaves.
  std::uint64_t grown() const {
    return options.beside + cell_bytes + chunks.size() * kBytesOfChunk + spool.blocks() * kBytesOfBlock +
           partition.leaves().size() * kBytesOfLeaf;
  }
  std::uint64_t workBytes() const {
    const std::uint64_t most = options.memory / 16 * 9;
    return most - std::min(most, grown());
  }
  std::uint64_t memoryForWork(std::uint64_t bytes) const { return (bytes + grown()) / 9 * 16 + 16; }
  // An eighth is the least to work with.
  void refuseWhatHasGrown() const;

  TilerOptions options;
  std::uint64_t most_in_chunk;
  Spool spool;
  std::vector<Chunk> chunks;
  std::vector<Split> splits;
  std::vector<Remnant> remnants;
  std::uint32_t last_chunk = 0;
  std::vector<std::uint32_t> order;  // of the chunks, by key

  std::vector<CellRecord> records;
  std::vector<std::uint64_t> digests;
  std::vector<std::string> given_names;
  Chain details;
  std::uint64_t segments = 0, visited = 0, cell_bytes = 0;
  std::vector<std::uint32_t> open;  // chunks that were begun since buffers were closed; some of them more than once
  std::size_t most_open = 0;
  std::size_t closed_chunks = 0;       // of the chunks, these have no buffer, but for one that is being split
  std::vector<GridPoint> snapped;      // of the cell at hand
  std::vector<std::uint8_t> is_child;  // likewise

  SampleSurvey survey;
  Partition partition{std::vector<CellKey>{CellKey{}}};
  std::vector<SegmentChain> long_segments;  // by worker
  std::vector<SampleChooser::Part> parts;   // by worker
  std::unique_ptr<const SampleChooser> chooser;
  std::unique_ptr<Spool> pair_spool;       // of small blocks: many are open at a time
  std::vector<std::uint32_t> group_begin;  // of cells
  std::vector<Chain> pair_chains;          // by worker, then by group
};

Tiler::Impl::Impl(TilerOptions given)
    : options(std::move(given)),
      most_in_chunk(0),
      spool(options.folder,
            options.folder.empty() || options.memory < kSmallMemory ? std::size_t{16} << 10 : std::size_t{64} << 10,
            options.chunk_segments != 0 ? 0 : options.memory / 4),
      details(spool) {
  options.memory = std::min(options.memory, kMostMemory);
  // All threads at work take a third. A chunk with no more ghosts than segments of its own never has a tile that is too
  // large to be built.
  most_in_chunk = options.chunk_segments != 0
                      ? options.chunk_segments
                      : std::min({kMostChunkSegments, options.memory / 3 / kBytesOfSegment / options.threads,
                                  options.memory / 4 / LeafBuilder::tileCost(1)});
  // A chunk that is split must be one that its midpoints make no leaf of.
  most_in_chunk = std::max<std::uint64_t>(most_in_chunk, options.capacity);
  most_open = std::max<std::size_t>(8, options.memory / 16 / spool.block_bytes());
  addChunk(CellKey{}, kNone, 0);
  parts.resize(options.threads);
  for (unsigned i = 0; i < options.threads; ++i) long_segments.emplace_back(spool);
}

std::uint32_t Tiler::Impl::addChunk(const CellKey& key, std::uint32_t parent, int side) {
  assert(chunks.size() < kChunkBit);
  chunks.push_back({key, key.box(), {}, SegmentChain(spool), SegmentChain(spool), parent, side});
  return static_cast<std::uint32_t>(chunks.size() - 1);
}

std::uint32_t Tiler::Impl::chunkOf(std::uint32_t split, const GridPoint& middle) const {
  std::uint32_t at = split;
  while ((at & kChunkBit) == 0) at = splits[at].child[middle[splits[at].axis] >= splits[at].plane];
  return at & ~kChunkBit;
}

void Tiler::Impl::put(std::uint32_t chunk, const SegmentRecord& record, const GridPoint& middle) {
  Chunk& to = chunks[chunk];
  if (!to.own.isOpen()) open.push_back(chunk);
  to.own.add(record);
  to.seen.extend(middle);
  // Each chunk that a split makes may have a buffer.
  if (to.own.count() > most_in_chunk && to.seen.lo != to.seen.hi && chunks.size() - closed_chunks < most_open)
    split(chunk);
}

// Halves the cell until the midpoints are on both sides: what it holds stays there until everything is read.
void Tiler::Impl::split(std::uint32_t chunk) {
  Remnant remnant{std::move(chunks[chunk].own), 0};
  remnant.chain.close();
  const GridBox seen = chunks[chunk].seen;
  CellKey key = chunks[chunk].key;
  std::uint32_t parent = chunks[chunk].parent;
  int side = chunks[chunk].side;
  for (bool apart = false; !apart;) {
    const int axis = key.depth % 3;
    const std::int64_t plane = mortonPoint(key.half(1).low)[axis];
    const auto self = static_cast<std::uint32_t>(splits.size());
    splits.push_back({plane, axis, {0, 0}});
    if (parent != kNone) splits[parent].child[side] = self;
    apart = seen.lo[axis] < plane && seen.hi[axis] >= plane;
    // The chunk's place in the list goes to the half that the loop goes on with, or to the lower one.
    const int kept = seen.lo[axis] >= plane ? 1 : 0;
    splits[self].child[1 - kept] = kChunkBit | addChunk(key.half(1 - kept), self, 1 - kept);
    splits[self].child[kept] = kChunkBit | chunk;
    key = key.half(kept);
    parent = self;
    side = kept;
    remnant.split = self;
  }
  chunks[chunk] = {key, key.box(), {}, SegmentChain(spool), SegmentChain(spool), parent, side};
  remnants.push_back(std::move(remnant));
}

void Tiler::Impl::take(Cell& cell) {
  const std::size_t n = cell.samples();
  if (cell.positions_um.size() != n || cell.radii_um.size() != n || cell.types.size() != n ||
      (cell.isGraph() ? !cell.parents.empty() : cell.parents.size() != n))
    throw UsageError("a cell was handed over with arrays of different lengths");
  if (n >= UINT32_MAX || cell.segmentRanks() >= UINT32_MAX)
    throw InputError(cell.source + ": more than 2^32 - 2 samples or links in one cell");
  if (records.size() == UINT32_MAX - 1) throw InputError("more than 2^32 - 2 cells: split the input into several sets");

  CellRecord record;
  record.source = std::move(cell.source);
  record.samples = n;
  snapped.clear();
  for (const Vector3d& p_W : cell.positions_um) {
    snapped.push_back(options.grid.snap(p_W));
    record.bounds.extend(snapped.back());
  }

  CellDetail detail;
  const auto ranks = static_cast<std::uint32_t>(cell.segmentRanks());
  is_child.assign(n, 0);  // 1: of some segment, or the parent of one in a forest
  if (!cell.isGraph()) {
    for (std::uint32_t i = 0; i < n; ++i) {
      const std::uint32_t parent = cell.parents[i];
      if (parent == kNoParent) continue;
      if (parent >= n || parent == i) throw UsageError("a cell was handed over with a parent that does not exist");
      is_child[i] = 1;
      is_child[parent] |= 2;  // a parent
    }
  } else {
    for (const auto& [child, parent] : cell.links) {
      if (child >= n || parent >= n) throw UsageError("a cell was handed over with a link to nowhere");
      if (child != parent) is_child[child] |= 1;
    }
  }
  for (std::uint32_t i = 0; i < n; ++i)
    if ((is_child[i] & 1) == 0) detail.roots.push_back({i, cell.radii_um[i], cell.types[i]});
  record.roots = detail.roots.size();

  const auto id = static_cast<std::uint32_t>(records.size());
  SegmentRecord segment = SegmentChain::first();
  for (std::uint32_t rank = 0; rank < ranks; ++rank) {
    const auto [child, parent] = cell.ends(rank);
    if (child == parent) {
      if (is_child[child] != 0) continue;  // the root of a tree
      ++record.isolated;
    } else {
      ++record.segments;
    }
    segment = {{id, rank}, child, parent, snapped[child], snapped[parent], cell.radii_um[child], cell.types[child]};
    const GridPoint middle = midpoint(segment.child, segment.parent);
    survey.addLength(segment.child, segment.parent);
    if (!contains(chunks[last_chunk].box, middle)) last_chunk = splits.empty() ? 0 : chunkOf(0, middle);
    put(last_chunk, segment, middle);
  }
  segments += record.segments + record.isolated;

  detail.sample_ids = std::move(cell.sample_ids);
  detail.block_starts = std::move(cell.block_starts);
  const Bytes bytes = encodeDetail(detail);
  const std::uint64_t size = bytes.size();
  details.append({reinterpret_cast<const std::uint8_t*>(&size), sizeof size});
  details.append(bytes);
  cell_bytes += kBytesOfCell + 4 * heapBytes(record.source) + 3 * heapBytes(cell.name);
  given_names.push_back(std::move(cell.name));
  digests.push_back(cell.digest);
  records.push_back(std::move(record));
  if (n > kMostSamplesKept) {
    snapped = {};
    is_child = {};
  }
  if (records.size() % 256 == 0) refuseWhatHasGrown();
}

void Tiler::Impl::closeOpen() {
  for (const std::uint32_t chunk : open) chunks[chunk].own.close();
  open.clear();
  closed_chunks = chunks.size();
}

// What split chunks held goes down to those that there are now; these may have to be split in turn.
void Tiler::Impl::settleRemnants(std::size_t from_remnant) {
  std::uint64_t done = 0;
  for (std::size_t i = from_remnant; i < remnants.size(); ++i) {
    SegmentChain chain = std::move(remnants[i].chain);
    const std::uint32_t from = remnants[i].split;
    SegmentChain::Reader reader(chain, true);
    std::uint32_t at = chunkOf(from, GridPoint::Zero());
    for (SegmentRecord record = SegmentChain::first(); reader.next(record);) {
      const GridPoint middle = midpoint(record.child, record.parent);
      if (!contains(chunks[at].box, middle)) at = chunkOf(from, middle);
      put(at, record, middle);
      if ((++done & 0xFFFF) == 0) step("sorting", done, 0);
    }
  }
  remnants.clear();
  closeOpen();
}

// Each chunk that could not be split because too many had buffers open is split now, one after the other.
void Tiler::Impl::settle() {
  settleRemnants(0);
  for (std::uint32_t i = 0; i < chunks.size(); ++i) {
    while (chunks[i].own.count() > most_in_chunk && chunks[i].seen.lo != chunks[i].seen.hi) {
      split(i);
      settleRemnants(0);
    }
  }
}

void Tiler::Impl::refuseWhatHasGrown() const {
  if (workBytes() >= options.memory / 8) return;
  throw InputError(std::to_string(records.size()) + " cells and " + std::to_string(partition.leaves().size()) +
                   " tiles take more memory than is given; ingest with --memory " +
                   std::to_string((grown() / 7 * 16 >> 20) + 1) + "MiB or more");
}

template <typename Work>
void Tiler::Impl::forEachChunk(const char* phase, const Work& work, const std::function<void(unsigned)>& free) {
  std::atomic<std::size_t> next{0};
  std::atomic<std::uint64_t> done{0};
  std::atomic<bool> failed{false};
  MemoryGate gate(std::max(workBytes(), options.memory / 8), options.threads);
  const auto run = [&](unsigned worker, std::exception_ptr& failure) {
    try {
      MemoryGate::Pass pass(gate);
      for (std::size_t i; !failed && (i = next.fetch_add(1)) < order.size();) {
        if (worker == 0) {
          step(phase, done, segments);
        } else {
          stopIfCancelled();
        }
        Chunk& chunk = chunks[order[i]];
        const std::uint64_t n = chunk.own.count();
        work(chunk, worker, gate, pass);
        done += n;
      }
      free(worker);
    } catch (...) {
      failure = std::current_exception();
      failed = true;
    }
  };
  const auto helpers =
      static_cast<unsigned>(std::min<std::size_t>(options.threads, std::max<std::size_t>(order.size(), 1))) - 1;
  std::vector<std::exception_ptr> failures(helpers + 1);
  {
    std::vector<std::jthread> pool;
    try {
      for (unsigned i = 1; i <= helpers; ++i) pool.emplace_back(run, i, std::ref(failures[i]));
    } catch (const std::system_error&) {
      // No more threads are to be had: those that there are do the work.
    }
    run(0, failures[0]);
  }
  for (const std::exception_ptr& failure : failures)
    if (failure) std::rethrow_exception(failure);
  stopIfCancelled();
}

void Tiler::Impl::cutChunk(Chunk& chunk, SampleSurvey& found_survey, SegmentChain& crossing,
                           std::vector<CellKey>& found) const {
  if (chunk.own.count() == 0) {
    found.push_back(chunk.key);
    return;
  }
  const bool alone = chunk.key.depth == 0;
  const GridBox closed = closedCell(chunk.key);
  std::vector<MortonKey> keys;
  keys.reserve(chunk.own.count());
  SegmentChain::Reader reader(chunk.own, false);
  for (SegmentRecord record = SegmentChain::first(); reader.next(record);) {
    keys.push_back(mortonKey(midpoint(record.child, record.parent)));
    if (!alone && !strictlyInside(closed, record.child, record.parent)) crossing.add(record);
  }
  sortKeys(keys);
  found_survey.addKeys(keys);
  const std::vector<CellKey> leaves = Partition::splitCell(chunk.key, keys, options.capacity);
  found.insert(found.end(), leaves.begin(), leaves.end());
}

// Gives each segment to all chunks but its own that store it; to those from `begin` to `end` in the order of keys. In
// several steps where the chunks have more buffers than may be open.
void Tiler::Impl::deliver(SegmentChain& crossing, std::size_t begin, std::size_t end) {
  const auto chunk_of_leaf = [&](std::uint32_t leaf) {
    const auto after = std::upper_bound(order.begin(), order.end(), leaf,
                                        [&](std::uint32_t l, std::uint32_t c) { return l < chunks[c].first_leaf; });
    return static_cast<std::size_t>(after - order.begin() - 1);
  };
  const std::size_t step = (end - begin + most_open - 1) / most_open;  // chunks that have a buffer together
  std::vector<SegmentChain> groups;
  if (step > 1)
    for (std::size_t i = begin; i < end; i += step) groups.emplace_back(spool);
  {
    SegmentChain::Reader reader(crossing, true);
    std::vector<std::uint32_t> met;
    for (SegmentRecord record = SegmentChain::first(); reader.next(record);) {
      if (!partition.leavesMet(record.child, record.parent, met, &visited))
        met = {partition.home(record.child), partition.home(record.parent)};
      const std::size_t own = chunk_of_leaf(partition.home(midpoint(record.child, record.parent)));
      std::sort(met.begin(), met.end());
      std::size_t last = SIZE_MAX, last_group = SIZE_MAX;
      for (std::uint32_t leaf : met) {
        if (last != SIZE_MAX && leaf < chunks[order[last]].end_leaf) continue;
        last = chunk_of_leaf(leaf);
        if (last == own || last < begin || last >= end) continue;
        if (step == 1) {
          chunks[order[last]].ghosts.add(record);
        } else if (const std::size_t to = (last - begin) / step; to != last_group) {
          groups[to].add(record);
          last_group = to;
        }
      }
    }
  }
  for (SegmentChain& group : groups) group.close();
  for (std::size_t i = 0; i < groups.size(); ++i) {
    stopIfCancelled();
    deliver(groups[i], begin + i * step, std::min(begin + (i + 1) * step, end));
  }
  if (step == 1)
    for (std::size_t i = begin; i < end; ++i) chunks[order[i]].ghosts.close();
}

void Tiler::Impl::handOver(std::uint32_t leaf, const CellKey& key, bool is_long, std::vector<StoredSegment>& stored,
                           TileAppearance& appearance, unsigned worker, TileSink& sink) {
  std::uint32_t cell = kNone;
  for (const StoredSegment& s : stored) {
    if (!s.owned || s.id.cell == cell) continue;
    cell = s.id.cell;
    const Pair pair{cell, leaf};
    pair_chains[worker * group_begin.size() + group(cell)].append(
        {reinterpret_cast<const std::uint8_t*>(&pair), sizeof pair});
  }
  chooser->addLeaf(key, stored, parts[worker]);
  sink.add(worker, leaf, key, is_long, stored, appearance);
}

LeafBuilder Tiler::Impl::builder(unsigned worker, TileSink& sink) {
  LeafBuilder made(partition, spool, long_segments[worker], options.capacity,
                   [this, worker, &sink](std::uint32_t leaf, std::vector<StoredSegment>& stored, TileAppearance& look) {
                     stopIfCancelled();
                     handOver(leaf, partition.leaves()[leaf], false, stored, look, worker, sink);
                   });
  made.memoryFor = [this](std::uint64_t bytes) { return memoryForWork(bytes); };
  return made;
}

// Where many ghosts meet, one tile may take more than there is: that is found before any tile is made.
void Tiler::Impl::refuseWhatCannotBeBuilt() {
  std::atomic<std::uint64_t> largest{0};
  forEachChunk("counting", [&](Chunk& chunk, unsigned worker, MemoryGate& gate, MemoryGate::Pass&) {
    const std::uint64_t own = chunk.own.count(), ghosts = chunk.ghosts.count();
    if (LeafBuilder::tileCost(own + ghosts) <= gate.limit()) return;
    if (ghosts <= own && own <= most_in_chunk && LeafBuilder::tileCost(2 * most_in_chunk) <= gate.limit()) return;
    LeafBuilder counter(partition, spool, long_segments[worker], options.capacity, {});
    SegmentChain* const chains[] = {&chunk.own, &chunk.ghosts};
    for (const std::uint64_t stored : counter.count(chains, rangeOf(chunk))) {
      std::uint64_t before = largest;
      while (stored > before && !largest.compare_exchange_weak(before, stored)) {
      }
    }
  });
  if (LeafBuilder::tileCost(largest) > workBytes())
    LeafBuilder::refuse(largest, memoryForWork(LeafBuilder::tileCost(largest)));
}

Tiler::Tiler(TilerOptions options) : impl_(std::make_unique<Impl>(std::move(options))) {}
Tiler::~Tiler() = default;

void Tiler::read(CellStream& stream) {
  Impl& t = *impl_;
  t.step("reading", 0, 0);
  for (Cell cell; stream.next(cell);) {
    t.step("reading", t.segments, 0);
    t.take(cell);
    if (cell.positions_um.capacity() > kMostSamplesKept) cell = Cell{};
  }
  t.settle();
  t.details.close();
  t.snapped = {};
  t.is_child = {};
  std::vector<std::string> sources;
  sources.reserve(t.records.size());
  for (const CellRecord& record : t.records) sources.push_back(record.source);
  std::vector<std::string> names = cellNames(sources, t.given_names);
  t.given_names = {};
  for (std::size_t i = 0; i < names.size(); ++i) t.records[i].name = std::move(names[i]);

  t.order.resize(t.chunks.size());
  std::iota(t.order.begin(), t.order.end(), 0u);
  std::sort(t.order.begin(), t.order.end(),
            [&](std::uint32_t a, std::uint32_t b) { return t.chunks[a].key.low < t.chunks[b].key.low; });
  t.refuseWhatHasGrown();
  for (const Impl::Chunk& chunk : t.chunks)
    if (chunk.own.count() > t.most_in_chunk && LeafBuilder::tileCost(chunk.own.count()) > t.workBytes())
      throw InputError(
          std::to_string(chunk.own.count()) +
          " segments have the same midpoint and belong to one tile, which takes more memory than is given; "
          "ingest with --memory " +
          std::to_string((t.memoryForWork(LeafBuilder::tileCost(chunk.own.count())) >> 20) + 1) + "MiB");
}

void Tiler::cut() {
  Impl& t = *impl_;
  // Surveys are joined in the order of keys, each as soon as those before it are there.
  std::vector<std::vector<CellKey>> leaves_of(t.chunks.size());
  std::vector<std::unique_ptr<SampleSurvey>> waiting(t.order.size());
  std::vector<std::size_t> place(t.order.size());
  for (std::size_t i = 0; i < t.order.size(); ++i) place[t.order[i]] = i;
  std::size_t joined = 0;
  std::mutex mutex;
  std::uint64_t leaf_count = 0;
  std::vector<SegmentChain> crossing;
  for (unsigned i = 0; i < t.options.threads; ++i) crossing.emplace_back(t.spool);
  t.forEachChunk("cutting", [&](Impl::Chunk& chunk, unsigned worker, MemoryGate& gate, MemoryGate::Pass& pass) {
    const std::uint64_t bytes = std::min(chunk.own.count() * kBytesOfCut, gate.limit());
    if (!pass.fits(bytes)) pass.change(bytes);
    const auto self = static_cast<std::size_t>(&chunk - t.chunks.data());
    auto survey = std::make_unique<SampleSurvey>();
    t.cutChunk(chunk, *survey, crossing[worker], leaves_of[self]);
    const std::lock_guard lock(mutex);
    leaf_count += leaves_of[self].size();
    if (leaf_count * kBytesOfLeaf > t.options.memory)
      throw InputError("the segments need more than " + std::to_string(leaf_count) +
                       " tiles, which takes more memory than is given; ingest with a larger --capacity, or with "
                       "--memory " +
                       std::to_string((leaf_count * kBytesOfLeaf * 2 >> 20) + 1) + "MiB or more");
    waiting[place[self]] = std::move(survey);
    for (; joined < waiting.size() && waiting[joined]; ++joined) {
      t.survey.add(*waiting[joined]);
      waiting[joined].reset();
    }
  });
  std::vector<CellKey> leaves;
  leaves.reserve(leaf_count);
  for (std::uint32_t c : t.order) {
    t.chunks[c].first_leaf = static_cast<std::uint32_t>(leaves.size());
    leaves.insert(leaves.end(), leaves_of[c].begin(), leaves_of[c].end());
    t.chunks[c].end_leaf = static_cast<std::uint32_t>(leaves.size());
    leaves_of[c] = {};
  }
  t.partition = Partition(std::move(leaves));
  t.refuseWhatHasGrown();
  const std::uint64_t packing = t.options.beside + t.cell_bytes + leaf_count * kBytesOfPackedLeaf,
                      free = t.options.memory / 8 * 7;
  if (packing > free)
    throw InputError(std::to_string(leaf_count) + " tiles take more memory than is given; ingest with --memory " +
                     std::to_string((packing / 7 * 8 >> 20) + 1) + "MiB");
  for (SegmentChain& chain : crossing) {
    chain.close();
    t.stopIfCancelled();
    t.deliver(chain, 0, t.order.size());
  }
  t.refuseWhatCannotBeBuilt();
}

void Tiler::tiles(TileSink& sink) {
  Impl& t = *impl_;
  t.chooser = std::make_unique<const SampleChooser>(t.options.grid, t.survey, samplePointsFor(t.segments));
  const std::uint64_t per_group =
      std::max<std::uint64_t>(1, std::min(kPairsPerGroup, t.options.memory / 8 / sizeof(Impl::Pair)));
  std::uint64_t in_group = per_group;
  for (std::uint32_t cell = 0; cell < t.records.size(); ++cell) {
    if (in_group >= per_group) {
      t.group_begin.push_back(cell);
      in_group = 0;
    }
    in_group += t.records[cell].segments + t.records[cell].isolated;
  }
  if (t.group_begin.empty()) t.group_begin.push_back(0);
  t.pair_spool =
      std::make_unique<Spool>(t.options.folder, kPairBlock, t.options.chunk_segments != 0 ? 0 : t.options.memory / 64);
  for (std::size_t i = 0; i < t.group_begin.size() * t.options.threads; ++i) t.pair_chains.emplace_back(*t.pair_spool);

  std::vector<LeafBuilder> builders;
  builders.reserve(t.options.threads);
  for (unsigned i = 0; i < t.options.threads; ++i) builders.push_back(t.builder(i, sink));
  t.forEachChunk(
      "writing tiles",
      [&](Impl::Chunk& chunk, unsigned worker, MemoryGate& gate, MemoryGate::Pass& pass) {
        SegmentChain* const chains[] = {&chunk.own, &chunk.ghosts};
        builders[worker].build(chains, Impl::rangeOf(chunk), gate, pass);
      },
      [&](unsigned worker) { builders[worker].release(); });
  for (const LeafBuilder& builder : builders) t.visited += builder.visited();
  builders.clear();

  std::uint64_t count = 0;
  for (SegmentChain& chain : t.long_segments) {
    chain.close();
    count += chain.count();
  }
  if (LeafBuilder::tileCost(count) > t.workBytes())
    throw InputError(std::to_string(count) + " segments meet more than " + std::to_string(kMaxLeavesOfSegment) +
                     " tiles each and belong to one tile, which takes more memory than is given; ingest with a larger "
                     "--capacity, or with --memory " +
                     std::to_string((t.memoryForWork(LeafBuilder::tileCost(count)) >> 20) + 1) + "MiB");
  if (count > 0) {
    std::vector<SegmentRecord> records;
    records.reserve(count);
    for (SegmentChain& chain : t.long_segments) {
      SegmentChain::Reader reader(chain, true);
      for (SegmentRecord record = SegmentChain::first(); reader.next(record);) records.push_back(record);
    }
    std::sort(records.begin(), records.end(),
              [](const SegmentRecord& a, const SegmentRecord& b) { return a.id < b.id; });
    std::vector<StoredSegment> stored;
    stored.reserve(count);
    TileAppearance appearance;
    for (const SegmentRecord& r : records) {
      stored.push_back({r.id, r.child_sample, r.parent_sample, r.child, r.parent, true});
      appearance.radii_um.push_back(r.radius_um);
      appearance.types.push_back(r.type);
    }
    records = {};
    t.handOver(static_cast<std::uint32_t>(t.partition.leaves().size()), CellKey{}, true, stored, appearance, 0, sink);
  }
  for (Chain& chain : t.pair_chains) chain.close();
  t.spool.trim();
}

SamplePoints Tiler::samples() { return impl_->chooser->finish(impl_->parts); }

void Tiler::details(std::span<const TileId> tile_of, const std::function<void(ByteSpan detail)>& use) {
  Impl& t = *impl_;
  Chain::Reader rest(t.details, true);
  std::vector<Impl::Pair> pairs;
  std::size_t at = 0;
  const std::size_t groups = t.group_begin.size();
  std::size_t group = 0;  // the next
  for (std::uint32_t cell = 0; cell < t.records.size(); ++cell) {
    if (group < groups && t.group_begin[group] == cell) {
      t.step("writing cells", cell, t.records.size());
      pairs.clear();
      at = 0;
      std::size_t size = 0;
      for (unsigned worker = 0; worker < t.options.threads; ++worker)
        size += t.pair_chains[worker * groups + group].bytes() / sizeof(Impl::Pair);
      pairs.reserve(size);
      for (unsigned worker = 0; worker < t.options.threads; ++worker) {
        Chain& chain = t.pair_chains[worker * groups + group];
        const std::size_t n = chain.bytes() / sizeof(Impl::Pair);
        pairs.resize(pairs.size() + n);
        Chain::Reader(chain, true)
            .read(reinterpret_cast<std::uint8_t*>(pairs.data() + pairs.size() - n), n * sizeof(Impl::Pair));
      }
      std::sort(pairs.begin(), pairs.end(), [](const Impl::Pair& a, const Impl::Pair& b) {
        return a.cell != b.cell ? a.cell < b.cell : a.leaf < b.leaf;
      });
      ++group;
    }
    const std::size_t begin = at;
    while (at < pairs.size() && pairs[at].cell == cell) ++at;
    ByteWriter out;
    out.varint(at - begin);
    TileId last = 0;
    for (std::size_t i = begin; i < at; ++i) {
      const TileId tile = tile_of[pairs[i].leaf];
      out.varint(tile - last);
      last = tile;
    }
    std::uint64_t size = 0;
    rest.read(reinterpret_cast<std::uint8_t*>(&size), sizeof size);
    Bytes bytes(size);
    rest.read(bytes.data(), size);
    out.append(ByteSpan(bytes).subspan(1));  // after the number of tiles, 0
    use(out.bytes());
  }
}

const std::vector<CellKey>& Tiler::leaves() const { return impl_->partition.leaves(); }
const std::vector<CellRecord>& Tiler::records() const { return impl_->records; }
const std::vector<std::uint64_t>& Tiler::digests() const { return impl_->digests; }
std::uint64_t Tiler::segments() const { return impl_->segments; }
std::uint64_t Tiler::spool_file_bytes() const { return impl_->spool.file_bytes(); }
std::size_t Tiler::chunks() const { return impl_->chunks.size(); }
std::uint64_t Tiler::visited() const { return impl_->visited; }

}  // namespace filiform::internal
