// SessionHouse: all sessions of a server. A pool of threads ticks them, one keeps house; the sessions on one revision
// of a set share its tiles and their budget. Thread rule: internally synchronised.
#pragma once

#include "tools/serve/session/remote_session.h"
#include "tools/serve/session/ticker_pool.h"
#include "tools/serve/sets/set_shelf.h"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace filiform::tools {

struct SessionHouseOptions {
  // Of the tiles of all sessions. One set has it all; of several, the first one that has sessions takes half, the next
  // one half of the rest. While sessions on an older revision of a set last, that revision has a part of its own.
  std::uint64_t budget_bytes = std::uint64_t{256} << 20;
  std::size_t most_sessions = 100;
  std::size_t threads = 1;      // that tick sessions
  std::string record_folder{};  // write each session's recording here; empty: none
};

struct SessionFigures {
  std::uint64_t open = 0, opened = 0, scenes = 0, tile_bytes = 0;
  TickerCounters ticker;
};

class SessionHouse {
 public:
  // The shelf must outlive this object.
  SessionHouse(const SetShelf& shelf, const SessionHouseOptions& options);
  ~SessionHouse();

  // `news` is called on a ticking thread after a round in which a session got a frame to send. It must not wait. Call
  // this while there are no sessions.
  void onNews(std::function<void()> news) { on_news_ = std::move(news); }

  // Begins a session on the newest revision of a set; it ticks until close(). `replaces`: the client closes another
  // session at once, which does not count. Throws Refusal 404 for a set that is unknown, or that `who` may not know of,
  // and 503 if there are too many sessions, or no thread has time for another; UsageError for options or a budget out
  // of range; CorruptTile, IoError.
  std::shared_ptr<RemoteSession> open(const std::string& set, RemoteSessionOptions options, bool replaces = false,
                                      const Person* who = nullptr);
  // Ends a session and its recording. A failure of the recording becomes a problem.
  void close(const std::shared_ptr<RemoteSession>& session);
  // Ends all sessions.
  void closeAll();

  const SetShelf& shelf() const { return shelf_; }
  SessionFigures figures() const;
  // New notes for the client of a session.
  std::vector<std::string> takeNotes(const RemoteSession& session);
  // Adds a line for the server's log.
  void tell(const std::string& problem);
  // New lines for the server's log.
  std::vector<std::string> takeProblems();

 private:
  struct Room {
    std::shared_ptr<RemoteSession> session;
    std::vector<std::string> notes;
  };
  struct Scene {
    std::shared_ptr<SharedScene> scene;
    std::chrono::steady_clock::time_point used;  // when a session last was on it
  };
  Ticker& tickerOf(const RemoteSession& session) const { return tickers_.ticker(session.options().ticker); }
  std::shared_ptr<SharedScene> sceneOf(const std::string& set, const Person* who);
  void keep();
  void serveRooms();
  std::vector<std::shared_ptr<SharedScene>> takeIdleScenes();

  const SetShelf& shelf_;
  const SessionHouseOptions options_;
  std::function<void()> on_news_;
  std::atomic<bool> news_{false};
  TickerPool tickers_;
  mutable std::mutex mutex_;
  std::mutex opening_;  // one session is opened at a time
  std::condition_variable stop_;
  bool stopping_ = false;
  std::vector<Room> rooms_;
  std::vector<Scene> scenes_;
  std::vector<std::string> problems_;
  std::uint64_t opened_ = 0;
  std::thread keeper_;
};

}  // namespace filiform::tools
