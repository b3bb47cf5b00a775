#include "index/internal/tiler.h"

#include "index/errors.h"
#include "index/internal/key_sort.h"
#include "index/internal/set_files.h"

#include <algorithm>
#include <cassert>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <numeric>
#include <system_error>
#include <thread>

namespace filiform::internal {
namespace {

// A segment of a chunk that is being cut into tiles takes about so much, ghosts and the tile at hand included.
constexpr std::uint64_t kBytesPerSegment = 160;
constexpr std::uint64_t kBytesPerTileSegment = 360;                   // where one tile holds the whole chunk
constexpr std::uint64_t kMostChunkSegments = std::uint64_t{1} << 19;  // more is no faster
constexpr std::uint64_t kSmallMemory = std::uint64_t{512} << 20;
constexpr std::uint64_t kPairsPerGroup = std::uint64_t{1} << 22;

bool contains(const GridBox& box, const GridPoint& p) {
  return (p.array() >= box.lo.array()).all() && (p.array() <= box.hi.array()).all();
}

// Does the segment meet no closed cell but this one's?
bool strictlyInside(const GridBox& closed, const GridPoint& a, const GridPoint& b) {
  return (a.array() > closed.lo.array()).all() && (a.array() < closed.hi.array()).all() &&
         (b.array() > closed.lo.array()).all() && (b.array() < closed.hi.array()).all();
}

// Sorted already but for a few runs, as they are when they come from a few chains.
template <typename T, typename Less>
void sortRuns(std::vector<T>& values, std::vector<std::size_t>& runs, Less less) {
  constexpr std::size_t kManyRuns = 16;
  runs.assign(1, 0);
  for (std::size_t i = 1; i < values.size(); ++i)
    if (less(values[i], values[i - 1])) runs.push_back(i);
  if (runs.size() == 1) return;
  if (runs.size() > kManyRuns) {
    std::sort(values.begin(), values.end(), less);
    return;
  }
  const auto at = [&](std::size_t run) {
    return values.begin() + static_cast<std::ptrdiff_t>(run < runs.size() ? runs[run] : values.size());
  };
  for (std::size_t width = 1; width < runs.size(); width *= 2)
    for (std::size_t run = 0; run + width < runs.size(); run += 2 * width)
      std::inplace_merge(at(run), at(run + width), at(run + 2 * width), less);
}

// Lets tasks in while their costs together stay within a limit; one alone may cost any amount.
class Turnstile {
 public:
  explicit Turnstile(std::uint64_t limit) : limit_(limit) {}
  void enter(std::uint64_t cost) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return taken_ == 0 || cost <= limit_ - std::min(limit_, taken_); });
    taken_ += cost;
  }
  void leave(std::uint64_t cost) {
    {
      const std::lock_guard lock(mutex_);
      taken_ -= cost;
    }
    changed_.notify_all();
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::uint64_t limit_, taken_ = 0;
};

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
  // What a thread needs to cut chunks into tiles, kept from one to the next.
  struct Workspace {
    std::vector<SegmentRecord> records;
    std::vector<std::uint64_t> placed, ordered;  // leaf or cell << 32 | place
    std::vector<std::uint32_t> begin;
    std::vector<GridBox> closed;
    std::vector<std::uint32_t> met;
    std::vector<std::size_t> runs;
    std::vector<StoredSegment> segments;
    TileAppearance appearance;
    std::vector<std::vector<Pair>> pairs;  // by group of cells
    std::uint64_t visited = 0;
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
  void cutChunk(Chunk& chunk, SampleSurvey& survey, SegmentChain& crossing, std::vector<CellKey>& found) const;
  void deliver(SegmentChain& crossing);
  void buildChunk(Chunk& chunk, unsigned worker, TileSink& sink);
  void handOver(std::uint32_t leaf, const CellKey& key, bool is_long, unsigned worker, TileSink& sink);
  template <typename Work>  // work(chunk, worker)
  void forEachChunk(const char* phase, const Work& work);
  std::uint64_t cost(const Chunk& chunk) const {
    return (chunk.own.count() + chunk.ghosts.count()) *
           (chunk.own.count() > most_in_chunk ? kBytesPerTileSegment : kBytesPerSegment);
  }
  std::size_t group(std::uint32_t cell) const { return cell / cells_per_group; }

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
  std::uint64_t segments = 0, visited = 0;
  std::vector<GridPoint> snapped;      // of the cell at hand
  std::vector<std::uint8_t> is_child;  // likewise

  SampleSurvey survey;
  Partition partition{std::vector<CellKey>{CellKey{}}};
  std::vector<Workspace> workspaces;
  std::vector<SegmentChain> long_segments;  // by worker
  std::vector<SampleChooser::Part> parts;   // by worker
  std::unique_ptr<const SampleChooser> chooser;
  std::uint32_t cells_per_group = 1;
  std::vector<Chain> pair_chains;  // by worker, then by group
};

Tiler::Impl::Impl(TilerOptions given)
    : options(std::move(given)),
      most_in_chunk(options.chunk_segments != 0
                        ? options.chunk_segments
                        : std::min(kMostChunkSegments, options.memory / 2 / kBytesPerSegment / options.threads)),
      spool(options.folder,
            options.folder.empty() || options.memory < kSmallMemory ? std::size_t{16} << 10 : std::size_t{64} << 10,
            options.chunk_segments != 0 ? 0 : options.memory / 4),
      details(spool) {
  // A chunk that is split must be one that its midpoints make no leaf of.
  most_in_chunk = std::max<std::uint64_t>(most_in_chunk, options.capacity);
  addChunk(CellKey{}, kNone, 0);
  workspaces.resize(options.threads);
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
  to.own.add(record);
  to.seen.extend(middle);
  if (to.own.count() > most_in_chunk && to.seen.lo != to.seen.hi) split(chunk);
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
  given_names.push_back(std::move(cell.name));
  digests.push_back(cell.digest);
  records.push_back(std::move(record));
}

// What split chunks held goes down to those that there are now; these may have to be split in turn.
void Tiler::Impl::settle() {
  std::uint64_t done = 0;
  for (std::size_t i = 0; i < remnants.size(); ++i) {
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
}

template <typename Work>
void Tiler::Impl::forEachChunk(const char* phase, const Work& work) {
  std::atomic<std::size_t> next{0};
  std::atomic<std::uint64_t> done{0};
  std::atomic<bool> failed{false};
  Turnstile memory(options.memory / 2);
  const auto run = [&](unsigned worker, std::exception_ptr& failure) {
    try {
      for (std::size_t i; !failed && (i = next.fetch_add(1)) < order.size();) {
        if (worker == 0) {
          step(phase, done, segments);
        } else {
          stopIfCancelled();
        }
        Chunk& chunk = chunks[order[i]];
        const std::uint64_t taken = cost(chunk), n = chunk.own.count();
        memory.enter(taken);
        try {
          work(chunk, worker);
        } catch (...) {
          memory.leave(taken);
          throw;
        }
        memory.leave(taken);
        done += n;
      }
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

// Gives each segment to all chunks but its own that store it.
void Tiler::Impl::deliver(SegmentChain& crossing) {
  const auto chunk_of_leaf = [&](std::uint32_t leaf) {
    const auto after = std::upper_bound(order.begin(), order.end(), leaf,
                                        [&](std::uint32_t l, std::uint32_t c) { return l < chunks[c].first_leaf; });
    return *(after - 1);
  };
  SegmentChain::Reader reader(crossing, true);
  std::vector<std::uint32_t> met;
  for (SegmentRecord record = SegmentChain::first(); reader.next(record);) {
    if (!partition.leavesMet(record.child, record.parent, met, &visited))
      met = {partition.home(record.child), partition.home(record.parent)};
    const std::uint32_t own = chunk_of_leaf(partition.home(midpoint(record.child, record.parent)));
    std::sort(met.begin(), met.end());
    std::uint32_t last = kNone;
    for (std::uint32_t leaf : met) {
      if (last != kNone && leaf < chunks[last].end_leaf) continue;
      last = chunk_of_leaf(leaf);
      if (last != own) chunks[last].ghosts.add(record);
    }
  }
}

void Tiler::Impl::handOver(std::uint32_t leaf, const CellKey& key, bool is_long, unsigned worker, TileSink& sink) {
  Workspace& w = workspaces[worker];
  std::uint32_t cell = kNone;
  for (const StoredSegment& s : w.segments) {
    if (!s.owned || s.id.cell == cell) continue;
    cell = s.id.cell;
    w.pairs[group(cell)].push_back({cell, leaf});
  }
  chooser->addLeaf(key, w.segments, parts[worker]);
  sink.add(worker, leaf, key, is_long, w.segments, w.appearance);
}

void Tiler::Impl::buildChunk(Chunk& chunk, unsigned worker, TileSink& sink) {
  const std::uint64_t own = chunk.own.count(), all = own + chunk.ghosts.count();
  if (all == 0) return;
  if (all >= kChunkBit)
    throw InputError("more than 2^31 segments have the same midpoint: one tile would have to hold them");
  Workspace& w = workspaces[worker];
  w.records.resize(all);
  std::size_t at_record = 0;
  for (SegmentChain* chain : {&chunk.own, &chunk.ghosts}) {
    SegmentChain::Reader reader(*chain, true);
    for (SegmentRecord record = SegmentChain::first(); reader.next(record);) w.records[at_record++] = record;
  }
  chunk.own.clear();
  chunk.ghosts.clear();

  const std::uint32_t first = chunk.first_leaf, end = chunk.end_leaf, count = end - first;
  const Partition::Subtree subtree = partition.subtree(chunk.core());
  w.closed.clear();
  for (std::uint32_t leaf = first; leaf < end; ++leaf) w.closed.push_back(closedCell(partition.leaves()[leaf]));
  w.begin.assign(count + 1, 0);
  w.placed.clear();
  const auto store = [&](std::uint32_t leaf, std::uint32_t record, bool owned) {
    w.placed.push_back(std::uint64_t{leaf - first} << 32 | (owned ? kChunkBit : 0) | record);
    ++w.begin[leaf - first + 1];
  };
  const auto meets = [&](const SegmentRecord& r) {
    return strictlyInside(subtree.cell, r.child, r.parent)
               ? partition.leavesMet(subtree, r.child, r.parent, w.met, &w.visited)
               : partition.leavesMet(r.child, r.parent, w.met, &w.visited);
  };
  std::uint32_t owner = first;
  for (std::uint32_t i = 0; i < all; ++i) {
    const SegmentRecord& r = w.records[i];
    const bool owned = i < own;
    if (owned) {
      const GridPoint middle = midpoint(r.child, r.parent);
      const GridBox& last = w.closed[owner - first];
      if ((middle.array() < last.lo.array()).any() || (middle.array() >= last.hi.array()).any())
        owner = partition.home(subtree, middle);
      if (strictlyInside(w.closed[owner - first], r.child, r.parent)) {
        store(owner, i, true);
        continue;
      }
    }
    if (meets(r)) {
      for (std::uint32_t leaf : w.met)
        if (leaf >= first && leaf < end) store(leaf, i, owned && leaf == owner);
      continue;
    }
    if (owned) long_segments[worker].add(r);
    const std::uint32_t home_a = partition.home(r.child), home_b = partition.home(r.parent);
    if (home_a >= first && home_a < end) store(home_a, i, false);
    if (home_b != home_a && home_b >= first && home_b < end) store(home_b, i, false);
  }
  std::partial_sum(w.begin.begin(), w.begin.end(), w.begin.begin());
  w.ordered.resize(w.placed.size());
  std::vector<std::uint32_t> next(w.begin.begin(), w.begin.end() - 1);
  for (std::uint64_t at : w.placed) w.ordered[next[at >> 32]++] = at;

  const auto record_of = [&](std::uint64_t at) -> const SegmentRecord& {
    return w.records[static_cast<std::uint32_t>(at) & ~kChunkBit];
  };
  std::vector<std::uint64_t> entries;
  for (std::uint32_t leaf = first; leaf < end; ++leaf) {
    const std::uint32_t from = w.begin[leaf - first], to = w.begin[leaf - first + 1];
    if (from == to) continue;
    entries.assign(w.ordered.begin() + from, w.ordered.begin() + to);
    sortRuns(entries, w.runs,
             [&](std::uint64_t a, std::uint64_t b) { return record_of(a).id.key() < record_of(b).id.key(); });
    w.segments.clear();
    w.appearance.radii_um.clear();
    w.appearance.types.clear();
    for (const std::uint64_t at : entries) {
      const SegmentRecord& r = record_of(at);
      w.segments.push_back({r.id, r.child_sample, r.parent_sample, r.child, r.parent, (at & kChunkBit) != 0});
      w.appearance.radii_um.push_back(r.radius_um);
      w.appearance.types.push_back(r.type);
    }
    handOver(leaf, partition.leaves()[leaf], false, worker, sink);
  }
  const std::size_t groups = w.pairs.size();
  for (std::size_t g = 0; g < groups; ++g) {
    pair_chains[worker * groups + g].append(
        {reinterpret_cast<const std::uint8_t*>(w.pairs[g].data()), w.pairs[g].size() * sizeof(Pair)});
    w.pairs[g].clear();
  }
}

Tiler::Tiler(TilerOptions options) : impl_(std::make_unique<Impl>(std::move(options))) {}
Tiler::~Tiler() = default;

void Tiler::read(CellStream& stream) {
  Impl& t = *impl_;
  t.step("reading", 0, 0);
  for (Cell cell; stream.next(cell);) {
    t.step("reading", t.segments, 0);
    t.take(cell);
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

  for (Impl::Chunk& chunk : t.chunks) chunk.own.close();
  t.order.resize(t.chunks.size());
  std::iota(t.order.begin(), t.order.end(), 0u);
  std::sort(t.order.begin(), t.order.end(),
            [&](std::uint32_t a, std::uint32_t b) { return t.chunks[a].key.low < t.chunks[b].key.low; });
  for (const Impl::Chunk& chunk : t.chunks)
    if (chunk.own.count() > t.most_in_chunk && t.cost(chunk) > t.options.memory / 2)
      throw InputError(
          std::to_string(chunk.own.count()) +
          " segments have the same midpoint and belong to one tile, which takes more memory than is given; "
          "ingest with --memory " +
          std::to_string((2 * t.cost(chunk) >> 20) + 1) + "MiB");
}

void Tiler::cut() {
  Impl& t = *impl_;
  struct Found {
    SampleSurvey survey;
    std::vector<CellKey> leaves;
  };
  std::vector<Found> found(t.chunks.size());
  std::vector<SegmentChain> crossing;
  for (unsigned i = 0; i < t.options.threads; ++i) crossing.emplace_back(t.spool);
  t.forEachChunk("cutting", [&](Impl::Chunk& chunk, unsigned worker) {
    Found& of = found[static_cast<std::size_t>(&chunk - t.chunks.data())];
    t.cutChunk(chunk, of.survey, crossing[worker], of.leaves);
  });
  std::vector<CellKey> leaves;
  for (std::uint32_t c : t.order) {
    t.chunks[c].first_leaf = static_cast<std::uint32_t>(leaves.size());
    leaves.insert(leaves.end(), found[c].leaves.begin(), found[c].leaves.end());
    t.chunks[c].end_leaf = static_cast<std::uint32_t>(leaves.size());
    t.survey.add(found[c].survey);
    found[c] = {};
  }
  t.partition = Partition(std::move(leaves));
  for (SegmentChain& chain : crossing) {
    chain.close();
    t.stopIfCancelled();
    t.deliver(chain);
  }
  for (Impl::Chunk& chunk : t.chunks) chunk.ghosts.close();
}

void Tiler::tiles(TileSink& sink) {
  Impl& t = *impl_;
  t.chooser = std::make_unique<const SampleChooser>(t.options.grid, t.survey, samplePointsFor(t.segments));
  const std::uint64_t groups = t.segments / kPairsPerGroup + 1;
  t.cells_per_group = static_cast<std::uint32_t>(t.records.size() / groups + 1);
  const std::size_t group_count = t.records.size() / t.cells_per_group + 1;
  for (Impl::Workspace& w : t.workspaces) w.pairs.resize(group_count);
  for (std::size_t i = 0; i < group_count * t.options.threads; ++i) t.pair_chains.emplace_back(t.spool);

  t.forEachChunk("writing tiles", [&](Impl::Chunk& chunk, unsigned worker) { t.buildChunk(chunk, worker, sink); });

  Impl::Workspace& w = t.workspaces[0];
  w.records = {};
  for (SegmentChain& chain : t.long_segments) {
    chain.close();
    SegmentChain::Reader reader(chain, true);
    for (SegmentRecord record = SegmentChain::first(); reader.next(record);) w.records.push_back(record);
  }
  if (!w.records.empty()) {
    std::sort(w.records.begin(), w.records.end(),
              [](const SegmentRecord& a, const SegmentRecord& b) { return a.id < b.id; });
    w.segments.clear();
    w.appearance = {};
    for (const SegmentRecord& r : w.records) {
      w.segments.push_back({r.id, r.child_sample, r.parent_sample, r.child, r.parent, true});
      w.appearance.radii_um.push_back(r.radius_um);
      w.appearance.types.push_back(r.type);
    }
    t.handOver(static_cast<std::uint32_t>(t.partition.leaves().size()), CellKey{}, true, 0, sink);
    for (std::size_t g = 0; g < w.pairs.size(); ++g)
      t.pair_chains[g].append(
          {reinterpret_cast<const std::uint8_t*>(w.pairs[g].data()), w.pairs[g].size() * sizeof(Impl::Pair)});
  }
  for (const Impl::Workspace& used : t.workspaces) t.visited += used.visited;
  t.workspaces.clear();
  for (Chain& chain : t.pair_chains) chain.close();
}

SamplePoints Tiler::samples() { return impl_->chooser->finish(impl_->parts); }

void Tiler::details(std::span<const TileId> tile_of, const std::function<void(ByteSpan detail)>& use) {
  Impl& t = *impl_;
  Chain::Reader rest(t.details, true);
  std::vector<Impl::Pair> pairs;
  std::size_t at = 0;
  const std::size_t groups = t.pair_chains.size() / t.options.threads;
  for (std::uint32_t cell = 0; cell < t.records.size(); ++cell) {
    if (cell % t.cells_per_group == 0) {
      t.step("writing cells", cell, t.records.size());
      pairs.clear();
      at = 0;
      for (unsigned worker = 0; worker < t.options.threads; ++worker) {
        Chain& chain = t.pair_chains[worker * groups + t.group(cell)];
        const std::size_t n = chain.bytes() / sizeof(Impl::Pair);
        pairs.resize(pairs.size() + n);
        Chain::Reader(chain, true)
            .read(reinterpret_cast<std::uint8_t*>(pairs.data() + pairs.size() - n), n * sizeof(Impl::Pair));
      }
      std::sort(pairs.begin(), pairs.end(), [](const Impl::Pair& a, const Impl::Pair& b) {
        return a.cell != b.cell ? a.cell < b.cell : a.leaf < b.leaf;
      });
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
