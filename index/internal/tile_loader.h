// The loader's side of Residency, whichever thread drives it: states, claims, room and reads. Time is a number that
// does not run back: ticks or seconds, as the pace says. index/README.md holds the table of states. Thread rule:
// thread-compatible: Residency holds its lock around every call. Calls that take the lock release it while the store
// reads; no other call reads from the store, unless mayReadPages(true).
#pragma once

#include "index/directory.h"
#include "index/internal/known_pages.h"
#include "index/internal/tile_channel.h"
#include "index/internal/tile_slots.h"
#include "index/prefetch.h"
#include "index/residency.h"

#include <deque>
#include <functional>
#include <limits>
#include <map>
#include <mutex>
#include <span>
#include <string>
#include <vector>

namespace filiform::internal {

struct LoaderPace {
  double hold;                     // how long a request stays a claim
  double first_retry, last_retry;  // of a tile that failed; doubles in between
  double replan;                   // at the latest
  double rest;                     // between plans, unless a reader is stuck or elsewhere
};
inline constexpr LoaderPace kTickPace{256, 64, 4096, 32, 0};
inline constexpr LoaderPace kSecondPace{0.25, 0.1, 5, 0.02, 0.004};

class TileLoader {
 public:
  using MayGo = std::function<bool(const TileSlot&)>;

  TileLoader(const TileStore& store, const ResidencyOptions& options);

  void setTime(double now, const LoaderPace& pace) {
    now_ = now;
    pace_ = pace;
  }
  double now() const { return now_; }

  TileReader& addReader();
  void adoptLongTile(std::shared_ptr<const Tile> tile);

  void takeAcknowledgements();
  void takeFocus();
  void takeRequests();
  // Applies all messages on the readers' behalf: they belong to the calling thread.
  void settle();

  // The tile becomes a claim for the pace's hold.
  void ask(TileId tile);
  // Where the claims may have changed: decides which of them the budget serves together, queues what is missing (not to
  // be read before `due`) and cancels queued tiles that are no longer among them.
  void planIfDue(double due);
  // While true, planIfDue() reads pages of the directory itself, under the caller's lock: for virtual time. While false
  // it throws PageAbsent, having changed nothing that reads depend on, where it needs a page that was not read yet.
  void mayReadPages(bool may) { pages_.mayRead(may); }
  // Reads that page; the lock is released meanwhile. The next plan is due at once then. False, and nothing done, if
  // another thread is reading it. Throws CorruptSet, IoError.
  bool readPage(std::uint32_t page, std::unique_lock<std::mutex>& lock);
  // It threw: listed by failed() until a plan succeeds.
  void planFailed(const std::string& why) { plan_failure_ = why; }

  // Reads the list of tiles of a cell that a reader is on, if one is missing; it is used from `due` on. True if it did;
  // the lock is let go meanwhile.
  bool fetchCells(double due, std::unique_lock<std::mutex>& lock);

  HoldId hold(std::span<const TileId> tiles, HoldKind kind);
  void releaseHold(HoldId hold);
  bool isHeld(HoldId hold) const;

  // Queued tiles whose time has come, best claim first.
  std::vector<TileId> dueTiles() const;
  // The first of them, or kNoTile. O(1) amortised over a plan, plus those queued that are not due yet; so is
  // dueBytes().
  TileId nextDue();
  std::uint64_t dueBytes(std::size_t most) const;   // of the first `most` of them
  double lastActive() const { return active_at_; }  // when a focus last moved or a tile was asked for
  // Evicts until `need` bytes fit, worst claims first, never a pinned tile or one that the last plan wants; or, with
  // `may_go`, one that may not. True if they fit now; with `at_once` (settling) also that is certain when evictions
  // sufficed.
  bool makeRoom(std::uint64_t need, bool at_once, const MayGo& may_go = {});
  // Requires room. The lock is let go while the store works. True if the tile is in memory now; else it is `failed`.
  bool read(TileId tile, std::unique_lock<std::mutex>& lock);

  bool inMemory(TileId tile) const { return loaded_.find(tile) != nullptr; }
  bool waitsForRetry(TileId tile) const;
  bool pinned(TileId tile) const;
  std::uint64_t bytesOf(TileId tile) const { return pages_.entry(tile).decoded_bytes; }

  const TileSlots& slots() const { return slots_; }
  const ResidencyCounters& counters() const { return counters_; }
  std::vector<std::string> failed() const;

 private:
  struct Peer {
    explicit Peer(std::size_t tile_count) : channel(tile_count) {}
    TileChannel channel;
    std::deque<TileMessage> outbox;
    std::size_t under_way = 0;
    ReaderFocus focus, planned;
    bool has_focus = false;
    bool walk_stale = true, around_stale = true;
    Vector3d around_W = Vector3d::Zero();  // where `around` was made
    double around_um = 0;                  // how far it reaches
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
  void claimTarget(Peer& peer);
  void tellTargets();
  std::span<const TileId> tilesOf(std::uint32_t cell);
  void countMiss(TileId tile);
  void use(TileId tile);
  void arrive(TileSlot& slot);
  void plan(double due);
  bool isDue(TileId tile) const;
  static bool goesLater(const TileSlot* a, const TileSlot* b);  // when room is made
  TileSlot* victim(const MayGo& may_go);
  void retire(TileSlot& slot);
  void release(TileSlot& slot);

  const TileStore& store_;
  KnownPages pages_;  // of the store
  std::vector<std::uint32_t> pages_read_now_;
  const ResidencyOptions options_;
  const Directory directory_;
  const Prefetch prefetch_;

  LoaderPace pace_ = kTickPace;
  double now_ = 0, planned_at_ = 0;
  bool stale_ = true;   // the last plan no longer holds
  bool urgent_ = true;  // and a reader waits for the next
  std::uint64_t plan_number_ = 0, ask_serial_ = 0;
  TileSlots slots_;
  std::map<TileId, Asked> asked_;
  std::map<TileId, std::string> failed_;
  std::map<std::uint32_t, std::string> failed_cells_;
  std::string plan_failure_;
  std::deque<Peer> peers_;
  TileTable loaded_;                          // ready or resident
  std::uint64_t reserved_ = 0, leaving_ = 0;  // bytes of tiles in reading, in retiring
  ResidencyCounters counters_;
  std::vector<Claim> claims_;
  std::vector<std::uint64_t> claimed_in_;  // number of the last plan with a claim on the tile
  std::vector<TileId> queue_;              // queued by the last plan, best claim first; those before head_ are done
  std::size_t head_ = 0;
  std::vector<TileSlot*> unwanted_;  // in memory, of no use to the last plan; the last one is to go first
  std::map<HoldId, Hold> holds_;
  HoldId next_hold_ = 1;
  std::map<std::uint32_t, CellTiles> cells_;  // by cell: of the readers' active nodes
  std::vector<bool> evicted_;                 // once, by tile
  double cells_due_ = std::numeric_limits<double>::infinity();
  double active_at_ = 0;
};

}  // namespace filiform::internal
