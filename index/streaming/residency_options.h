// States of tiles, options and counters of Residency. Thread rule: plain data.
#pragma once

#include "index/set/tile_store.h"

#include <cstdint>

namespace filiform {

// Where a tile is on its way into memory and out of it.
enum class TileState : std::uint8_t { absent, queued, reading, ready, resident, retiring, failed };

// How tiles are predicted: not at all, by distance, or along the neurite (prefetch.h).
enum class PrefetchPolicy : std::uint8_t { none, distance, structure };

struct ResidencyOptions {
  std::uint64_t budget_bytes = UINT64_MAX;  // bytes of all tiles in state ready, resident or retiring
  PrefetchPolicy prefetch = PrefetchPolicy::structure;
  // With PrefetchPolicy::structure: look-ahead time at the present speed. In real time it is shorter while reads are
  // fast, and longer while they are slow, as measured.
  double lookahead_s = 0.5;
  // Parallel reads in real time; more hide the latency of a slow disk. 0: 1, and for a set at an address as many as the
  // measured time of reads allows, from kLeastRemoteReads to kMostRemoteReads.
  unsigned io_threads = 0;
  static constexpr unsigned kLeastRemoteReads = 8, kMostRemoteReads = 64;
};

// What the loader has done so far.
struct ResidencyCounters {
  std::uint64_t reads = 0, bytes_read_decoded = 0, evictions = 0, failures = 0, cancelled = 0;
  std::uint64_t bytes = 0, peak_bytes = 0;    // counted against the budget
  std::uint64_t queued = 0, peak_queued = 0;  // tiles waiting to be read

  // A reader requested a tile that was not in memory, by cause. A repeated request counts once.
  std::uint64_t missed_unclaimed = 0;  // not predicted
  std::uint64_t missed_full = 0;       // predicted, but more urgent claims filled the budget
  std::uint64_t missed_late = 0;       // queued or being read
  std::uint64_t missed_evicted = 0;    // evicted earlier, and not predicted to be needed again
  std::uint64_t missed_failed = 0;     // cannot be read
  std::uint64_t misses() const { return missed_unclaimed + missed_full + missed_late + missed_evicted + missed_failed; }

  std::uint64_t entered = 0;  // a reader's active tile changed to one that is in memory
  // Tiles read without request; of these, later entered or requested; evicted unused.
  std::uint64_t prefetched = 0, prefetch_used = 0, prefetch_wasted = 0;
  double wait_sum = 0, wait_most = 0;  // time from queued to held by every reader: ticks in virtual time, else s
  std::uint64_t waits = 0;
  double read_mean_s = 0;  // in real time: moving average of the time of a read
};

// Why tiles are held in addition to what readers work on; see Residency::hold().
enum class HoldKind : std::uint8_t {
  target,  // of a jump: claimed after active tiles, before all others
  cell,    // of a highlighted or followed cell: claimed after tiles ahead of a proxy, before its surroundings
};
using HoldId = std::uint64_t;

}  // namespace filiform
