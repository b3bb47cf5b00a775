// TileSink: takes the leaves that a tiler cuts. Thread rule: see the class.
#pragma once

#include "index/ingest/tiling/internal/leaf_content.h"

#include <cstdint>

namespace filiform::internal {

// Receives the content of each leaf that stores segments, from several threads. The leaves lie in ranges, which
// together are all leaves; the long-segment tile follows as a range of its own. The leaves of a range come in order,
// from one worker. Ranges begin in the order of leaves and end in any order.
class TileSink {
 public:
  virtual ~TileSink() = default;
  virtual void begin(unsigned /*worker*/, std::uint32_t /*first*/) {}
  virtual void end(unsigned /*worker*/, std::uint32_t /*end*/) {}
  // The vectors of `content` may be moved from. `worker` < options.threads: calls of one worker do not overlap.
  virtual void add(unsigned worker, LeafContent& content) = 0;
};

}  // namespace filiform::internal
