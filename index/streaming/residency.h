// Residency: decides which tiles are in memory. It keeps a byte budget, a state for every tile and a table of tiles for
// each reader.
//
//   absent -> queued -> reading -> ready -> resident -> retiring -> absent        (any read) -> failed
//
// The loader (Residency) decides which tiles to load and to evict; only the loader reads the disk. A reader
// (TileReader) owns its table and changes it only by taking messages. Messages *add* and *retire* come through a
// single-producer ring; acknowledgements return through another. A tile is freed after every reader has acknowledged.
// README.md has the tables of states, threads and channels.
//
// The loader runs in one of two ways. In real time, its own IO threads run it (start, stop). In virtual time, the
// caller runs it (advance, loadTogether), so that a run without a window does not depend on the machine's speed.
#pragma once

#include "index/set/tile_store.h"
#include "index/streaming/tile_table.h"

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace filiform {

enum class TileState : std::uint8_t { absent, queued, reading, ready, resident, retiring, failed };
// The state's name, for messages.
const char* toString(TileState state);

// How tiles are predicted: not at all, by distance, or along the neurite (prefetch.h).
enum class PrefetchPolicy : std::uint8_t { none, distance, structure };

// What a reader works on, published once a tick. The loader turns it into claims on the budget.
struct ReaderFocus {
  TileId active_tile = kNoTile;                // pinned in memory
  NodeId active_node{UINT32_MAX, UINT32_MAX};  // a node of the proxy's segment; the walk ahead starts there
  Vector3d p_W = Vector3d::Zero();             // proxy, um
  Vector3d v_W = Vector3d::Zero();             // velocity of the proxy, um/s
  Vector3d pull_W = Vector3d::Zero();          // from the proxy to the hand, um
  double radius_um = 0;                        // half the workspace: tiles within it are claimed, nearest first
  bool is_view = false;                        // for a camera: its surroundings come after those of all proxies
  // A pending jump that waits for its tiles; kNoTile: none. These tiles are claimed after the active tiles.
  TileId target_tile = kNoTile;
  NodeId target_node{UINT32_MAX, UINT32_MAX};  // a node in target_tile
  Vector3d target_W = Vector3d::Zero();        // um
};

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

// What one hand or camera asks for. Safe in the haptic thread: every member is noexcept, without allocation, lock or
// system call. Thread rule: owned by one reading thread.
class TileFocus {
 public:
  virtual ~TileFocus() = default;
  // Publishes what the hand works on; once a tick.
  virtual void publishFocus(const ReaderFocus& focus) noexcept = 0;
  // Requests an absent tile, which becomes urgent. A repeated request is harmless. A request is lost if the ring is
  // full and must then be repeated.
  virtual void request(TileId tile) noexcept = 0;
  // True if the pending jump can be made. The table then holds the target tile. With prefetch it also holds the tiles
  // that the proxy may reach within 2.75 times of the fastest read, at least 0.14 s and at most 0.5 s, as far as the
  // budget goes.
  virtual bool isTargetReady(NodeId target_node) const noexcept = 0;
};

// The reader's side: a table of tiles, and the focus of the one who uses it. As TileFocus.
class TileReader : public TileFocus {
 public:
  virtual const TileTable& tiles() const noexcept = 0;
  // Takes up to `most` messages from the loader, changes the table and acknowledges them. Returns the number of
  // messages.
  virtual int apply(int most = 8) noexcept = 0;
};

// Thread rule: internally synchronised; call addReader() before start(). Many hands can share one reader's table
// (addFocus), if one thread serves them all.
class Residency {
 public:
  // Loads and pins the long-segment tile. Checks the budget in O(tiles). Takes 20 bytes a tile, and 8 more for each
  // reader. Throws UsageError if the budget is below floorBytes(); the message states this value. Throws CorruptTile or
  // IoError if the tile cannot be read. The store must outlive this object.
  Residency(const TileStore& store, const ResidencyOptions& options);
  ~Residency();

  // Smallest budget: the two largest tiles plus the long-segment tile, bytes. O(tiles).
  static std::uint64_t floorBytes(const TileStore& store);

  // Adds a reader. It lives as long as the Residency.
  TileReader& addReader(const std::string& name);
  // Adds a hand that uses the table of a reader, on that reader's thread. Takes 2 KB, whatever the number of tiles. In
  // real time, plans then come at least 0.2 ms apart for each hand, and each hand's surroundings are claimed within its
  // part of the budget. May be called at any time.
  TileFocus& addFocus();
  // Ends the claims of a hand and frees it. Its thread must not use it any more.
  void removeFocus(TileFocus& focus);

  // Real time: IO threads serve focus and requests until stop(). A second start() throws std::logic_error; stop() is
  // idempotent.
  void start();
  void stop();
  // Does one round of an IO thread's work on the calling thread: takes messages, plans, reads at most one tile. Returns
  // true if it read one. `now_s`: any clock, s, that never runs backwards. Must not be called between start() and
  // stop().
  bool serve(double now_s);

  // Virtual time, without threads. All readers belong to the calling thread. advance() and loadTogether() apply all
  // messages to the readers' tables before they return.
  //
  // advance() takes focus and requests of all readers at `tick`. A newly claimed tile becomes due at tick +
  // latency_ticks. The first call whose tick reaches this value loads the tile and evicts others if needed.
  //
  // A tile that cannot be read becomes `failed` and is counted. While claimed, it is tried again after 64 ticks, then
  // 128, ... 4096 (in real time 0.1 s ... 5 s). Claims are recomputed on a request, when a focus moves by 1/32 of its
  // radius or to another tile, and every 32 ticks.
  void advance(std::uint64_t tick, std::uint64_t latency_ticks);

  // Makes all of `tiles` resident at once, with latency 0. It may evict other tiles, but none that a focus pins.
  // Returns false, without eviction, if the tiles exceed the budget together. Also returns false if a read fails now. A
  // failed tile is tried again at once: the caller waits for it, and decides when to repeat the call. The tiles count
  // as requested during the next 256 ticks.
  bool loadTogether(std::span<const TileId> tiles);

  // Claims tiles until release(), in the given order, as far as the budget goes. Tiles of HoldKind::cell are claimed
  // nearest to a reader first. Ids out of range are ignored. Any thread except a haptic one may call it, at any time.
  HoldId hold(std::span<const TileId> tiles, HoldKind kind);
  void release(HoldId hold);
  // True if every reader has all of the hold's tiles for which the budget has room, at least the first. False for an
  // unknown hold. A tile that cannot be read keeps it false; see state().
  bool isHeld(HoldId hold) const;

  TileState state(TileId tile) const;
  // Of all tiles that are not absent, in order of tiles, at one moment. O(their number).
  std::vector<std::pair<TileId, TileState>> states() const;
  ResidencyCounters counters() const;
  std::uint64_t budget_bytes() const;
  // One line for each tile whose last read failed: tile, file, offset, reason; by tile id. Then the other failed reads:
  // lists of cells, pages of the directory.
  std::vector<std::string> failures() const;
  // The lines of failures() whose tile, list or page a reader needs now. O(failures).
  std::vector<std::string> missing() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform
