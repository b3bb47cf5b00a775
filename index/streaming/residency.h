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
#include "index/streaming/residency_options.h"
#include "index/streaming/tile_reader.h"
#include "index/streaming/tile_table.h"

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace filiform {

// The state's name, for messages.
const char* toString(TileState state);

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
