// WaitingSegments: keeps segments of cells until their group is put together, in memory and then in an unnamed file in
// the folder of temporary files.
#pragma once

#include "index/tile/internal/segment_chain.h"
#include "index/tile/passed_segment.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace filiform::internal {

// Thread rule: thread-compatible. Throws IoError if the disk is full.
class WaitingSegments {
 public:
  static constexpr std::size_t kLeastBytes = 8 << 10;  // of memory, for each group

  // Requires groups > 0 and memory_bytes >= kLeastBytes * groups.
  WaitingSegments(std::size_t groups, std::uint64_t memory_bytes);

  // Keeps some segments of one cell in a tile, at least one.
  void add(std::size_t group, TileId tile, std::span<const PassedSegment> segments);
  // Calls use(tile, segments) for each add() of the group, in order, and forgets the group.
  void take(std::size_t group, const std::function<void(TileId, std::span<const PassedSegment>)>& use);

 private:
  struct Run {  // of an add()
    TileId tile;
    std::uint32_t segments;
  };
  struct Group {
    SegmentChain segments;
    ByteChain runs;
  };
  Spool spool_;
  std::vector<Group> groups_;
};

}  // namespace filiform::internal
