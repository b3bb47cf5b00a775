#include "index/ingest/tiling/internal/crowded_leaves.h"

#include "index/workers.h"

#include <algorithm>
#include <utility>

namespace filiform::internal {
namespace {

constexpr std::uint64_t kSampledOneIn = 64;
constexpr std::size_t kMostLeaves = 16;

}  // namespace

template <typename Use>
void CrowdedLeaves::forEachMet(const SegmentRecord& record, Work& work, const Use& use) {
  std::vector<std::uint32_t>& met = work.met;
  if (!partition_.leavesMet(record.child, record.parent, met, &work.visited))
    met = {partition_.home(record.child), partition_.home(record.parent)};
  for (std::size_t i = 0; i < met.size(); ++i)
    if (i == 0 || met[i] != met[i - 1]) use(met[i]);
}

template <typename Use>
void CrowdedLeaves::forEachRecord(SegmentChain& chain, const Use& use) {
  std::uint64_t number = 0;
  SegmentChain::Reader reader(chain, false);
  for (SegmentRecord record = SegmentChain::first(); reader.next(record); ++number) {
    if ((number & 0xFFFF) == 0) stop_();
    use(record, number);
  }
}

CrowdedLeaves::CrowdedLeaves(const Partition& partition, std::span<SegmentChain> crossing, std::function<void()> stop)
    : partition_(partition), crossing_(crossing), stop_(std::move(stop)) {
  std::vector<std::atomic<std::uint32_t>> sampled(partition.leaves().size());
  std::atomic<std::size_t> next{0};
  runWorkers(std::max<std::size_t>(1, crossing_.size()), [&](unsigned, const std::atomic<bool>& failed) {
    Work work;
    for (std::size_t i; !failed && (i = next.fetch_add(1)) < crossing_.size();)
      forEachRecord(crossing_[i], [&](const SegmentRecord& record, std::uint64_t number) {
        if (number % kSampledOneIn != 0) return;
        forEachMet(record, work, [&](std::uint32_t leaf) { sampled[leaf].fetch_add(1, std::memory_order_relaxed); });
      });
    visited_ += work.visited;
  });
  for (std::uint32_t leaf = 0; leaf < sampled.size(); ++leaf) leaves_.push_back(leaf);
  const std::size_t most = std::min(kMostLeaves, leaves_.size());
  std::partial_sort(leaves_.begin(), leaves_.begin() + static_cast<std::ptrdiff_t>(most), leaves_.end(),
                    [&](std::uint32_t a, std::uint32_t b) { return sampled[a] > sampled[b]; });
  leaves_.resize(most);
  estimate_ = sampled[leaves_.front()] * kSampledOneIn;
  const std::uint32_t least = sampled[leaves_.front()] / 8 * 7;
  std::erase_if(leaves_, [&](std::uint32_t leaf) { return sampled[leaf] < least; });
}

std::uint64_t CrowdedLeaves::count(const std::function<Chunk(std::uint32_t leaf)>& chunkOf) {
  std::vector<GridBox> closed;
  for (const std::uint32_t leaf : leaves_) closed.push_back(closedBlock(partition_.leaves()[leaf]));
  std::vector<std::uint64_t> stored(leaves_.size(), 0);
  Work work;
  const auto count = [&](const SegmentRecord& record, std::size_t begin, std::size_t end) {
    const auto meets = [&](std::size_t i) { return segmentMeetsBox(record.child, record.parent, closed[i]); };
    while (begin < end && !meets(begin)) ++begin;
    if (begin == end) return;
    forEachMet(record, work, [&](std::uint32_t leaf) {
      for (std::size_t i = begin; i < end; ++i) stored[i] += leaf == leaves_[i];
    });
  };
  for (SegmentChain& chain : crossing_)
    forEachRecord(chain, [&](const SegmentRecord& record, std::uint64_t) { count(record, 0, leaves_.size()); });
  for (std::size_t i = 0; i < leaves_.size(); ++i) {
    const Chunk chunk = chunkOf(leaves_[i]);
    forEachRecord(*chunk.own, [&](const SegmentRecord& record, std::uint64_t) {
      if (strictlyInside(chunk.closed_block, record.child, record.parent)) count(record, i, i + 1);
    });
  }
  visited_ += work.visited;
  return *std::max_element(stored.begin(), stored.end());
}

}  // namespace filiform::internal
