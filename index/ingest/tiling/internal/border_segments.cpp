#include "index/ingest/tiling/internal/border_segments.h"

#include "index/ingest/tiling/internal/crowded_leaves.h"
#include "index/workers.h"

#include <algorithm>
#include <utility>

namespace filiform::internal {

CutLeaves cutChunk(Chunk& chunk, std::uint32_t capacity, LandmarkSurvey& survey, SegmentChain& crossing,
                   CutWork& work) {
  if (chunk.own.count() == 0) return {{chunk.key}, {0}};
  const bool alone = chunk.key.depth == 0;
  const GridBox closed = closedBlock(chunk.key);
  std::vector<MortonKey>& keys = work.keys;
  keys.clear();
  keys.reserve(chunk.own.count());
  MortonKeys key;
  SegmentChain::Reader reader(chunk.own, false);
  for (SegmentRecord record = SegmentChain::first(); reader.next(record);) {
    keys.push_back(key.of(midpoint(record.child, record.parent)));
    if (!alone && !strictlyInside(closed, record.child, record.parent)) crossing.add(record);
  }
  work.sorter.sort(keys);
  survey.addKeys(keys);
  CutLeaves found{Partition::splitBlock(chunk.key, keys, capacity), {}};
  found.midpoints.reserve(found.keys.size());
  auto at = keys.begin();
  for (const BlockKey& leaf : found.keys) {
    const auto end = std::upper_bound(at, keys.end(), leaf.high());
    found.midpoints.push_back(static_cast<std::uint32_t>(end - at));
    at = end;
  }
  return found;
}

namespace {

constexpr std::size_t kGroupsOfThread = 4;

// A chunk is one block, unless it stands for all leaves of another rank.
std::vector<BlockKey> blocksOf(const std::vector<Chunk>& chunks, const Partition& partition,
                               std::vector<std::uint32_t>& chunk_of) {
  std::vector<BlockKey> blocks;
  const std::vector<BlockKey>& leaves = partition.leaves();
  for (std::uint32_t c = 0; c < chunks.size(); ++c) {
    const Chunk& chunk = chunks[c];
    const bool is_block =
        leaves[chunk.first_leaf].low == chunk.key.low && leaves[chunk.end_leaf - 1].high() == chunk.key.high();
    if (is_block) blocks.push_back(chunk.key);
    for (std::uint32_t leaf = chunk.first_leaf; !is_block && leaf < chunk.end_leaf; ++leaf)
      blocks.push_back(leaves[leaf]);
    chunk_of.resize(blocks.size(), c);
  }
  return blocks;
}

}  // namespace

BorderSegments::BorderSegments(Chunks& chunks, const Partition& partition, Spool& spool, Options options)
    : chunks_(chunks.all()),
      spool_(spool),
      options_(std::move(options)),
      blocks_(blocksOf(chunks_, partition, chunk_of_)) {}

// Calls use(chunk, record) for all chunks that store the segment, except its own, ascending.
template <typename Use>
void BorderSegments::forEachChunk(SegmentChain& crossing, Work& work, const Use& use) {
  constexpr std::uint64_t kBetweenCalls = 65536;
  SegmentChain::Reader reader(crossing, true);
  for (SegmentRecord record = SegmentChain::first(); reader.next(record);) {
    if (!blocks_.leavesMet(record.child, record.parent, work.met, &work.visited)) {
      work.met = {blocks_.home(record.child), blocks_.home(record.parent)};
      std::sort(work.met.begin(), work.met.end());
    }
    const std::uint32_t own = chunk_of_[blocks_.home(midpoint(record.child, record.parent))];
    std::uint32_t last = own;
    for (const std::uint32_t block : work.met) {
      const std::uint32_t chunk = chunk_of_[block];
      if (chunk != last && chunk != own) use(chunk, record);
      last = chunk;
    }
    if (++work.moved % kBetweenCalls == 0) options_.moved(work.worker, kBetweenCalls);
  }
}

// Sorts segments into groups of `step` chunks each.
void BorderSegments::sortOut(SegmentChain& crossing, std::size_t begin, std::size_t step,
                             std::span<SegmentChain> groups, Work& work) {
  std::uint64_t last = UINT64_MAX;
  std::size_t last_group = 0;
  forEachChunk(crossing, work, [&](std::uint32_t chunk, const SegmentRecord& record) {
    const std::size_t group = (chunk - begin) / step;
    if (chunk < begin || group >= groups.size() || (last == work.moved && last_group == group)) return;
    groups[group].add(record);
    last = work.moved;
    last_group = group;
  });
  for (SegmentChain& group : groups) group.close();
}

void BorderSegments::deliver(std::span<SegmentChain> crossing) {
  const std::size_t threads = std::max<std::size_t>(1, options_.threads), n = chunks_.size();
  const std::size_t most_open = std::max<std::size_t>(2, options_.most_open / threads);
  const std::size_t wanted = threads == 1 ? 1 : threads * kGroupsOfThread;
  const std::size_t groups = std::min({std::max(wanted, (n + most_open - 1) / most_open), most_open, n});
  const std::size_t step = (n + groups - 1) / groups;
  std::vector<SegmentChain> sorted;  // by chain, then by group
  for (std::size_t i = 0; groups > 1 && i < crossing.size() * groups; ++i) sorted.emplace_back(spool_);
  const auto onAllThreads = [&](std::size_t count, const auto& run) {
    std::atomic<std::size_t> next{0};
    runWorkers(std::clamp<std::size_t>(count, 1, threads), [&](unsigned worker, const std::atomic<bool>& failed) {
      Work work{worker, most_open};
      for (std::size_t i; !failed && (i = next.fetch_add(1)) < count;) run(i, work);
      visited_ += work.visited;
    });
  };
  if (groups == 1) {
    onAllThreads(1, [&](std::size_t, Work& work) {
      for (SegmentChain& chain : crossing) deliver(chain, 0, n, work);
    });
    return;
  }
  onAllThreads(crossing.size(), [&](std::size_t i, Work& work) {
    sortOut(crossing[i], 0, step, std::span(sorted).subspan(i * groups, groups), work);
  });
  onAllThreads(groups, [&](std::size_t group, Work& work) {
    SegmentChain& all = sorted[group];
    for (std::size_t i = 1; i < crossing.size(); ++i) all.take(sorted[i * groups + group]);
    deliver(all, group * step, std::min((group + 1) * step, n), work);
  });
}

void BorderSegments::deliver(SegmentChain& crossing, std::size_t begin, std::size_t end) {
  Work work{0, options_.most_open};
  deliver(crossing, begin, end, work);
  visited_ += work.visited;
}

// Takes several steps if the chunks need more buffers than may be open.
void BorderSegments::deliver(SegmentChain& crossing, std::size_t begin, std::size_t end, Work& work) {
  if (begin >= end) return;
  const std::size_t step = (end - begin + work.most_open - 1) / work.most_open;
  if (step == 1) {
    forEachChunk(crossing, work, [&](std::uint32_t chunk, const SegmentRecord& record) {
      if (chunk >= begin && chunk < end) chunks_[chunk].ghosts.add(record);
    });
    for (std::size_t i = begin; i < end; ++i) chunks_[i].ghosts.close();
    return;
  }
  std::vector<SegmentChain> groups;
  for (std::size_t i = begin; i < end; i += step) groups.emplace_back(spool_);
  sortOut(crossing, begin, step, groups, work);
  for (std::size_t i = 0; i < groups.size(); ++i)
    deliver(groups[i], begin + i * step, std::min(begin + (i + 1) * step, end), work);
}

}  // namespace filiform::internal
