// Which tiles are in memory: a byte budget, a state for every tile, and one table of tiles for each reader.
//
//   absent -> queued -> reading -> ready -> resident -> retiring -> absent        (any read) -> failed
//
// The loader side (Residency) decides what to load and what to let go; it alone touches the disk. A reader (TileReader)
// owns its table and changes it only by taking messages: *add* and *retire* come over a single-producer ring,
// acknowledgements go back over another; a tile is freed after every reader has acknowledged. README.md holds the
// tables of states, threads and channels.
//
// The loader is driven in one of two ways: by its own IO threads (start/stop; real time), or by the caller, call by
// call, in virtual time (advance, loadTogether), so that a headless run does not depend on the machine.
#pragma once

#include "index/tile_store.h"
#include "index/tile_table.h"

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace filiform {

enum class TileState : std::uint8_t { absent, queued, reading, ready, resident, retiring, failed };
const char* toString(TileState state);

enum class PrefetchPolicy : std::uint8_t { none, distance, structure };

// What a reader is about, published once a tick: the loader turns it into claims on the budget.
struct ReaderFocus {
  TileId active_tile = kNoTile;                // pinned
  NodeId active_node{UINT32_MAX, UINT32_MAX};  // a node at the proxy's segment (the structure is followed from there)
  Vector3d p_W = Vector3d::Zero();             // proxy, um
  Vector3d v_W = Vector3d::Zero();             // its velocity, um/s
  double radius_um = 0;                        // half the workspace: tiles within are wanted, nearest first
  bool is_view = false;                        // an eye's: its surroundings come after those of all hands
  // A jump that waits for its tiles, if target_tile is one: claimed after the active tiles.
  TileId target_tile = kNoTile;
  NodeId target_node{UINT32_MAX, UINT32_MAX};  // a node there
  Vector3d target_W = Vector3d::Zero();        // um
};

struct ResidencyOptions {
  std::uint64_t budget_bytes = UINT64_MAX;  // bytes of all tiles in ready, resident or retiring
  PrefetchPolicy prefetch = PrefetchPolicy::structure;
  double lookahead_s = 0.5;  // structure: how far ahead at the present speed
  unsigned io_threads = 1;   // at least 1: reads under way at once in real time; more hide a far disk's latency
};

struct ResidencyCounters {
  std::uint64_t reads = 0, bytes_read_decoded = 0, evictions = 0, failures = 0, cancelled = 0;
  std::uint64_t bytes = 0, peak_bytes = 0;    // against the budget
  std::uint64_t queued = 0, peak_queued = 0;  // tiles waiting to be read

  // A reader asked for a tile that was not in memory, by why it was not: a repeated request counts once.
  std::uint64_t missed_unclaimed = 0;  // nothing had foreseen it
  std::uint64_t missed_full = 0;       // foreseen, but better claims filled the budget
  std::uint64_t missed_late = 0;       // queued or being read
  std::uint64_t missed_evicted = 0;    // it had been in memory before, and nothing foresaw that it is wanted again
  std::uint64_t missed_failed = 0;     // it cannot be read
  std::uint64_t misses() const { return missed_unclaimed + missed_full + missed_late + missed_evicted + missed_failed; }

  std::uint64_t entered = 0;  // a reader's active tile changed to one in memory
  std::uint64_t prefetched = 0, prefetch_used = 0, prefetch_wasted = 0;  // read unasked; then entered or asked for; let
                                                                         // go of without either
  double wait_sum = 0, wait_most = 0;  // from queued to held by every reader: ticks in virtual time, else s
  std::uint64_t waits = 0;
};

// Why tiles are held beyond what readers are about, see Residency::hold.
enum class HoldKind : std::uint8_t {
  target,  // of a jump: after active tiles, before everything else
  cell,    // of a cell that is highlighted or followed: after what lies ahead of a hand, before its surroundings
};
using HoldId = std::uint64_t;

// Haptic-safe: every member is noexcept, without allocation, lock or system call. Thread rule: owned by one reading
// thread.
class TileReader {
 public:
  virtual ~TileReader() = default;
  virtual const TileTable& tiles() const noexcept = 0;
  // Takes up to `most` messages from the loader into the table and acknowledges them. Returns how many.
  virtual int apply(int most = 8) noexcept = 0;
  virtual void publishFocus(const ReaderFocus& focus) noexcept = 0;
  // Asks for a tile that was met absent: it becomes urgent. Asking again is harmless; lost requests (ring full) must be
  // repeated.
  virtual void request(TileId tile) noexcept = 0;
  // The jump that the focus waits with may be made: the table holds its tile and, as far as the budget goes, those
  // where the hand may get to within 0.3 s (nothing but the tile without prefetch).
  virtual bool isTargetReady(NodeId target_node) const noexcept = 0;
};

// Thread rule: internally synchronised; addReader before start().
class Residency {
 public:
  // Loads and pins the long-segment tile. O(tiles): checks the floor, and takes 20 bytes a tile, and 8 for each reader.
  // Throws UsageError when the budget is below floorBytes() (the text states the
  // floor), CorruptTile or IoError from that load. The store must outlive it.
  Residency(const TileStore& store, const ResidencyOptions& options);
  ~Residency();

  // The two largest tiles plus the long-segment tile. O(tiles).
  static std::uint64_t floorBytes(const TileStore& store);

  // The reader lives as long as the Residency.
  TileReader& addReader(const std::string& name);

  // Real time: IO threads serve focus and requests until stop(). start() twice is a std::logic_error; stop() is
  // idempotent.
  void start();
  void stop();
  // One round of that thread's work by the caller instead: takes messages, plans, and reads at most one tile. True if
  // it read one. `now_s` is any clock that does not run back. Not while started.
  bool serve(double now_s);

  // Virtual time, without a thread: all readers belong to the calling thread, and both calls bring their tables up to
  // date (messages applied without limit) before they return.
  //
  // Takes focus and requests of all readers at `tick`; each tile newly wanted becomes due at tick + latency_ticks, and
  // is loaded, with eviction as needed, by the first call whose tick has reached that. A tile that cannot be read
  // becomes `failed` and is counted; it is tried again, while wanted, after 64 ticks, then 128, ... 4096 (in real time
  // 0.1 s ... 5 s). What is wanted is reconsidered on requests, when a focus moved by 1/32 of its radius or to another
  // tile, and every 32 ticks.
  void advance(std::uint64_t tick, std::uint64_t latency_ticks);

  // Latency 0: makes all of `tiles` resident at once, evicting others but none of these nor a tile that a reader's
  // focus pins. False, with nothing evicted, if they do not fit the budget together or one waits to be tried again;
  // false too if one fails now. They count as asked for during the next 256 ticks.
  bool loadTogether(std::span<const TileId> tiles);

  // Claims tiles until release(), in the order given as far as the budget goes (a cell's: nearest to a reader first).
  // Ids out of range are ignored. At any time, from any thread but a haptic one.
  HoldId hold(std::span<const TileId> tiles, HoldKind kind);
  void release(HoldId hold);
  // Every reader has all of its tiles that the budget has room for, at least the first; false for an unknown hold. A
  // tile that cannot be read is waited for: see state().
  bool isHeld(HoldId hold) const;

  TileState state(TileId tile) const;
  // Of all tiles that are not absent, in order of tiles, at one moment. O(their number).
  std::vector<std::pair<TileId, TileState>> states() const;
  ResidencyCounters counters() const;
  std::uint64_t budget_bytes() const;
  // One line for each tile whose last read failed: tile, file, offset, reason. In order of tiles. Then what else could
  // not be read: lists of cells, pages of the directory.
  std::vector<std::string> failures() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform
