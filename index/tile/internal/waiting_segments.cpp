#include "index/tile/internal/waiting_segments.h"

#include <algorithm>

namespace filiform::internal {

// Half of the memory is for the buffers of the groups, two each.
WaitingSegments::WaitingSegments(std::size_t groups, std::uint64_t memory_bytes)
    : spool_(temporaryFolder(), std::clamp<std::uint64_t>(memory_bytes / 4 / groups, kLeastBytes / 4, 1 << 18),
             memory_bytes / 2, "the segments of cells") {
  groups_.reserve(groups);
  for (std::size_t i = 0; i < groups; ++i) groups_.push_back({SegmentChain(spool_), ByteChain(spool_)});
}

void WaitingSegments::add(std::size_t group, TileId tile, std::span<const PassedSegment> segments) {
  Group& to = groups_[group];
  for (const PassedSegment& s : segments)
    to.segments.add({s.id, s.child_sample, s.parent_sample, s.child, s.parent, s.radius_um, s.type});
  const Run run{tile, static_cast<std::uint32_t>(segments.size())};
  to.runs.append({reinterpret_cast<const std::uint8_t*>(&run), sizeof run});
}

void WaitingSegments::take(std::size_t group, const std::function<void(TileId, std::span<const PassedSegment>)>& use) {
  Group& from = groups_[group];
  from.segments.close(), from.runs.close();
  std::uint64_t left = from.runs.bytes() / sizeof(Run);
  SegmentChain::Reader records(from.segments, true);
  ByteChain::Reader runs(from.runs, true);
  SegmentRecord r = SegmentChain::first();
  std::vector<PassedSegment> segments;
  for (Run run{}; left > 0; --left) {
    runs.read(reinterpret_cast<std::uint8_t*>(&run), sizeof run);
    segments.clear();
    for (std::uint32_t i = 0; i < run.segments && records.next(r); ++i)
      segments.push_back({r.id, r.child_sample, r.parent_sample, r.child, r.parent, r.radius_um, r.type});
    use(run.tile, segments);
  }
}

}  // namespace filiform::internal
