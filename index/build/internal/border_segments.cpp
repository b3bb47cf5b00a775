#include "index/build/internal/border_segments.h"

#include "index/build/internal/crowded_leaves.h"

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

BorderSegments::BorderSegments(Chunks& chunks, const Partition& partition, Spool& spool, std::size_t most_open,
                               std::function<void()> stop)
    : chunks_(chunks), partition_(partition), spool_(spool), most_open_(most_open), stop_(std::move(stop)) {}

void BorderSegments::deliver(SegmentChain& crossing) {
  stop_();
  deliver(crossing, 0, chunks_.all().size());
}

// Takes several steps if the chunks need more buffers than may be open.
void BorderSegments::deliver(SegmentChain& crossing, std::size_t begin, std::size_t end) {
  std::vector<Chunk>& chunks = chunks_.all();
  const std::size_t step = (end - begin + most_open_ - 1) / most_open_;  // chunks with a buffer at the same time
  std::vector<SegmentChain> groups;
  if (step > 1)
    for (std::size_t i = begin; i < end; i += step) groups.emplace_back(spool_);
  {
    SegmentChain::Reader reader(crossing, true);
    std::vector<std::uint32_t> met;
    for (SegmentRecord record = SegmentChain::first(); reader.next(record);) {
      if (!partition_.leavesMet(record.child, record.parent, met, &visited_))
        met = {partition_.home(record.child), partition_.home(record.parent)};
      const std::size_t own = chunks_.ofLeaf(partition_.home(midpoint(record.child, record.parent)));
      std::sort(met.begin(), met.end());
      std::size_t last = SIZE_MAX, last_group = SIZE_MAX;
      for (std::uint32_t leaf : met) {
        if (last != SIZE_MAX && leaf < chunks[last].end_leaf) continue;
        last = chunks_.ofLeaf(leaf);
        if (last == own || last < begin || last >= end) continue;
        if (step == 1) {
          chunks[last].ghosts.add(record);
        } else if (const std::size_t to = (last - begin) / step; to != last_group) {
          groups[to].add(record);
          last_group = to;
        }
      }
    }
  }
  for (SegmentChain& group : groups) group.close();
  for (std::size_t i = 0; i < groups.size(); ++i) {
    stop_();
    deliver(groups[i], begin + i * step, std::min(begin + (i + 1) * step, end));
  }
  if (step == 1)
    for (std::size_t i = begin; i < end; ++i) chunks[i].ghosts.close();
}

}  // namespace filiform::internal
