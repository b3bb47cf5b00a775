// The loader of Residency: states, claims, budget and reads. Time is a number that never decreases, in ticks or seconds
// (see Pace). index/README.md has the table of states. Thread rule: thread-compatible; Residency holds its lock around
// every call. Functions that take the lock release it while the store reads. No other function reads from the store,
// except after mayReadPages(true).
#pragma once

#include "index/query/tile_finder.h"
#include "index/streaming/internal/known_pages.h"
#include "index/streaming/internal/prefetch.h"
#include "index/streaming/internal/read_latency.h"
#include "index/streaming/internal/reads_in_flight.h"
#include "index/streaming/internal/tile_channel.h"
#include "index/streaming/internal/tile_slots.h"
#include "index/streaming/residency_options.h"
#include "index/streaming/tile_reader.h"

#include <deque>
#include <functional>
#include <limits>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

namespace filiform::internal {

struct LoaderPace {
  double hold;                     // how long a request remains a claim
  double first_retry, last_retry;  // of a failed tile; the delay doubles from first to last
  double replan;                   // longest time between plans
  double rest;                     // shortest time between plans, unless a reader is blocked or moved far
  bool is_real;                    // seconds: reads are timed
};
inline constexpr LoaderPace kTickPace{256, 64, 4096, 32, 0, false};
inline constexpr LoaderPace kSecondPace{0.25, 0.1, 5, 0.02, 0.004, true};

class TileLoader {
 public:
  using MayGo = std::function<bool(const TileSlot&)>;

  // `leaves`: called under the lock before it is released for a read, so that another thread goes on meanwhile.
  TileLoader(const TileStore& store, const ResidencyOptions& options, std::function<void()> leaves);

  void setTime(double now, const LoaderPace& pace) {
    now_ = now;
    pace_ = pace;
  }
  double now() const { return now_; }

  TileReader& addReader();
  TileFocus& addFocus();
  void removeFocus(const TileFocus& focus);
  void adoptLongTile(std::shared_ptr<const Tile> tile);

  void takeAcknowledgements();
  void takeFocus();
  void takeRequests();
  // Applies all messages for the readers, which belong to the calling thread.
  void settle();

  // Makes the tile a claim for the time Pace::hold.
  void ask(TileId tile);
  // If the claims may have changed, makes a new plan: decides which claims fit the budget together, queues the missing
  // tiles (to be read from `due` on), and cancels queued tiles without a claim.
  void planIfDue(double due);
  // True: planIfDue() reads pages of the directory itself, under the caller's lock; for virtual time. It then throws
  // CorruptSet, IoError. False: a plan leaves out what lies in pages that are not read, and notes these pages.
  void mayReadPages(bool may) { pages_.mayRead(may); }
  // Reads the most urgent noted page with the lock released; the next plan is then due at once. Returns false, without
  // effect, if there is none that no other thread reads. A page that cannot be read is tried again like a tile.
  bool readPage(std::unique_lock<std::mutex>& lock);

  // Reads one missing list of tiles of a cell on which a reader is; the list is used from `due` on. Returns true if it
  // read one. Releases the lock meanwhile.
  bool fetchCells(double due, std::unique_lock<std::mutex>& lock);

  HoldId hold(std::span<const TileId> tiles, HoldKind kind);
  void releaseHold(HoldId hold);
  bool isHeld(HoldId hold) const;

  // Queued tiles that are due, the most urgent first.
  std::vector<TileId> dueTiles() const;
  // More reads of tiles may begin; decided from the measured time of reads.
  bool mayReadMore() const { return reading_ < in_flight_.most(); }
  // nextDue: the most urgent tile that is due, or kNoTile. dueBytes: bytes of the first `most` due tiles. Both O(1)
  // amortised over a plan, plus the queued tiles that are not due.
  TileId nextDue();
  std::uint64_t dueBytes(std::size_t most) const;
  double lastActive() const { return active_at_; }  // when a focus last moved or a tile was requested
  // Evicts tiles until `need` bytes fit, the least urgent first. Never evicts a pinned tile, a tile that the last plan
  // wants, or a tile that `may_go` refuses. Returns true if the bytes fit. With `at_once`, settles, so that the result
  // is exact.
  bool makeRoom(std::uint64_t need, bool at_once, const MayGo& may_go = {});
  // Requires room. Releases the lock while the store works. Returns true if the tile is now in memory; otherwise it is
  // `failed`.
  bool read(TileId tile, std::unique_lock<std::mutex>& lock);

  bool inMemory(TileId tile) const { return loaded_.find(tile) != nullptr; }
  bool waitsForRetry(TileId tile) const;
  bool pinned(TileId tile) const;
  std::uint64_t bytesOf(TileId tile) const { return pages_.entry(tile).decoded_bytes; }

  const TileSlots& slots() const { return slots_; }
  const ResidencyCounters& counters() const { return counters_; }
  std::vector<std::string> failed() const;
  std::vector<std::string> missing() const;

 private:
  struct Peer {
    explicit Peer(std::unique_ptr<TileChannel> r) : reader(std::move(r)), ends(reader->ends) {}
    explicit Peer(std::unique_ptr<FocusChannel<TileFocus>> h) : hand(std::move(h)), ends(hand->ends) {}
    const std::unique_ptr<TileChannel> reader;            // nullptr: it uses the table of another
    const std::unique_ptr<FocusChannel<TileFocus>> hand;  // nullptr: it is a reader
    FocusEnds& ends;
    std::deque<TileMessage> outbox;
    std::size_t under_way = 0;
    ReaderFocus focus, planned;
    bool has_focus = false;
    bool walk_stale = true, around_stale = true;
    double target_time_s = 0;              // within which the hand may reach a tile of `target`
    bool target_open = false;              // pages are missing that may hold more tiles of `target`
    Vector3d around_W = Vector3d::Zero();  // position for which `around` was made
    double around_um = 0;                  // its radius
    std::vector<TileClaim> ahead, around, target;
  };
  enum class Rank : std::uint8_t { pinned, target, asked, ahead, kept, around, view };
  struct Hold {
    std::vector<TileId> tiles;
    HoldKind kind;
    std::uint64_t made_in_plan;
  };
  struct CellTiles {
    std::vector<TileId> tiles;
    double usable, retry, backoff;  // retry: of a list that could not be read
    std::uint64_t last_plan = 0;
  };
  struct Claim {
    TileId tile;
    Rank rank;
    double cost;
  };
  struct Asked {
    double until;
    std::uint64_t serial;
  };

  void send(const TileMessage& message);
  void flush();
  void collectClaims();
  void claimHolds();
  void claimFor(Peer& peer);
  double targetTime_s() const;
  std::vector<std::uint32_t> cellsOfReaders() const;  // whose lists of tiles are wanted
  void claimTarget(Peer& peer);
  void claimBesideTarget(const ReaderFocus& there, std::uint64_t room, double time_s,
                         std::vector<TileClaim>& claims) const;
  void tellTargets();
  // In real time, for peers without a table: the shortest time between plans, s; and the part of the budget of each.
  double crowdRest() const;
  std::uint64_t partOf(const Peer& peer) const;
  std::span<const TileId> tilesOf(std::uint32_t cell);
  void countMiss(TileId tile);
  void use(TileId tile);
  void arrive(TileSlot& slot);
  void plan(double due);
  bool isDue(TileId tile) const;
  static bool goesLater(const TileSlot* a, const TileSlot* b);  // order of eviction
  TileSlot* victim(const MayGo& may_go);
  void retire(TileSlot& slot);
  void release(TileSlot& slot);

  const TileStore& store_;
  KnownPages pages_;  // of the store
  std::vector<std::uint32_t> pages_read_now_;
  struct FailedPage {
    double retry, backoff;
    std::string line;
  };
  std::map<std::uint32_t, FailedPage> failed_pages_;
  const ResidencyOptions options_;
  const std::function<void()> leaves_;
  const TileFinder finder_;
  Prefetch prefetch_;
  ReadLatency latency_;
  ReadsInFlight in_flight_;
  unsigned reading_ = 0;  // tiles being read

  LoaderPace pace_ = kTickPace;
  double now_ = 0, planned_at_ = 0;
  double plan_took_ = 0;  // in real time, s
  bool stale_ = true;     // the last plan is outdated
  bool urgent_ = true;    // and a reader waits for the next plan
  std::uint64_t plan_number_ = 0, ask_serial_ = 0;
  TileSlots slots_;
  std::map<TileId, Asked> asked_;
  std::map<TileId, std::string> failed_;
  std::map<std::uint32_t, std::string> failed_cells_;
  std::list<Peer> peers_;
  std::size_t readers_ = 0;                   // of the peers, those with a table
  TileTable loaded_;                          // tiles that are ready or resident
  std::uint64_t reserved_ = 0, leaving_ = 0;  // bytes of tiles in reading, in retiring
  ResidencyCounters counters_;
  std::vector<Claim> claims_;
  std::vector<std::uint64_t> claimed_in_;  // number of the last plan with a claim on the tile
  std::vector<TileId> queue_;              // queued by the last plan, most urgent first; those before head_ are done
  std::size_t head_ = 0;
  std::vector<TileSlot*> unwanted_;  // in memory without use for the last plan; the last one is evicted first
  std::map<HoldId, Hold> holds_;
  HoldId next_hold_ = 1;
  std::map<std::uint32_t, CellTiles> cells_;  // by cell of a reader's active node
  std::vector<bool> evicted_;                 // by tile: was evicted once
  double cells_due_ = std::numeric_limits<double>::infinity();
  double active_at_ = 0;
};

}  // namespace filiform::internal
