#include "tools/serve/session/session_house.h"

#include "index/text.h"
#include "tools/words/refusal.h"

#include <algorithm>
#include <exception>
#include <unistd.h>
#include <utility>

namespace filiform::tools {

namespace {

constexpr std::chrono::milliseconds kHousekeeping{5};
constexpr std::chrono::seconds kIdleScene{10};  // how long a set's tiles stay in memory without a session
constexpr std::size_t kMostScenes = 3;          // revisions of one set with sessions

}  // namespace

SessionHouse::SessionHouse(const SetShelf& shelf, const SessionHouseOptions& options)
    : shelf_(shelf), options_(options), tickers_(std::max<std::size_t>(options.threads, 1), [this] {
        if (news_.exchange(false, std::memory_order_acquire) && on_news_) on_news_();
      }) {
  keeper_ = std::thread([this] { keep(); });
}

SessionHouse::~SessionHouse() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  stop_.notify_all();
  keeper_.join();
  for (Room& room : std::exchange(rooms_, {})) tickerOf(*room.session).remove(*room.session);
}

std::shared_ptr<SharedScene> SessionHouse::sceneOf(const std::string& set, const Person* who) {
  const std::shared_ptr<const ServedSet> served = shelf_.find(set, who);
  if (served == nullptr) throw Refusal(404, "there is no set '" + escaped(set, 60) + "'; hello lists the sets");
  std::size_t revisions = 0;
  {
    const std::lock_guard lock(mutex_);
    for (const Scene& scene : scenes_) {
      if (&scene.scene->served() == served.get()) return scene.scene;
      revisions += scene.scene->served().name() == set;
    }
  }
  if (revisions >= kMostScenes)
    throw Refusal(503, "sessions on older revisions of this set take its memory; ask again when they have ended");
  // The first set takes half of the budget, the next one half of the rest: few of many sets have sessions at once.
  std::uint64_t part = options_.budget_bytes;
  if (shelf_.all().size() > 1) {
    {
      const std::lock_guard lock(mutex_);
      for (const Scene& scene : scenes_)
        if (scene.scene->served().name() != set) part -= std::min(part, scene.scene->residency().budget_bytes());
    }
    const std::uint64_t least = Residency::floorBytes(served->set());
    if (part < least && least <= options_.budget_bytes)  // else the residency refuses
      throw Refusal(503,
                    "sessions on other sets take the memory that sessions may have; ask again when they have ended");
    part = std::min(std::max(part / 2, least), options_.budget_bytes);
  }
  const auto scene = std::make_shared<SharedScene>(served, part, tickers_.tickers());
  const std::lock_guard lock(mutex_);
  scenes_.push_back({scene, std::chrono::steady_clock::now()});
  return scene;
}

std::shared_ptr<RemoteSession> SessionHouse::open(const std::string& set, RemoteSessionOptions options, bool replaces,
                                                  const Person* who) {
  const std::lock_guard one_at_a_time(opening_);
  {
    const std::lock_guard lock(mutex_);
    if (rooms_.size() >= options_.most_sessions + (replaces ? 1 : 0))
      throw Refusal(503, "the server has " + std::to_string(options_.most_sessions) +
                             " sessions, its most; ask again when one has ended");
    options.number = static_cast<std::uint32_t>(++opened_);
  }
  options.news = &news_;
  if (!options_.record_folder.empty())
    options.record = options_.record_folder + "/session-" + std::to_string(::getpid()) + "-" +
                     std::to_string(options.number) + ".rec";
  const std::optional<std::size_t> place = tickers_.enter();
  if (!place)
    throw Refusal(503, "the sessions of this server take the time that it has for them; ask again when one has ended");
  options.ticker = *place;
  std::shared_ptr<RemoteSession> session;
  try {
    session = std::make_shared<RemoteSession>(sceneOf(set, who), options);
  } catch (...) {
    tickers_.leave(*place);
    throw;
  }
  Ticker& ticker = tickerOf(*session);
  ticker.add(*session);
  const std::lock_guard lock(mutex_);
  rooms_.push_back({session, {}});
  if (const std::string refusal = ticker.refusal(); options.number == 1 && !refusal.empty())
    problems_.push_back("sessions: " + refusal);
  return session;
}

void SessionHouse::close(const std::shared_ptr<RemoteSession>& session) {
  if (session == nullptr) return;
  tickerOf(*session).remove(*session);
  tickers_.leave(session->options().ticker);
  std::string problem;
  try {
    session->finish();
  } catch (const std::exception& failure) {
    problem = failure.what();
  }
  const std::lock_guard lock(mutex_);
  std::erase_if(rooms_, [&](const Room& room) { return room.session == session; });
  if (!problem.empty()) problems_.push_back(std::move(problem));
}

void SessionHouse::closeAll() {
  std::vector<std::shared_ptr<RemoteSession>> sessions;
  {
    const std::lock_guard lock(mutex_);
    for (const Room& room : rooms_) sessions.push_back(room.session);
  }
  for (const auto& session : sessions) close(session);
}

void SessionHouse::serveRooms() {
  std::vector<std::shared_ptr<RemoteSession>> sessions;
  {
    const std::lock_guard lock(mutex_);
    for (const Room& room : rooms_) sessions.push_back(room.session);
  }
  for (const auto& session : sessions) {
    std::vector<std::string> problems, notes = session->serve(&problems);
    for (const std::string& problem : problems) tell(problem);
    if (notes.empty()) continue;
    constexpr std::size_t kMostNotes = 16;  // of a client that does not take them
    const std::lock_guard lock(mutex_);
    for (Room& room : rooms_)
      if (room.session == session)
        for (std::string& note : notes)
          if (room.notes.size() < kMostNotes) room.notes.push_back(std::move(note));
  }
}

std::vector<std::shared_ptr<SharedScene>> SessionHouse::takeIdleScenes() {
  const auto now = std::chrono::steady_clock::now();
  std::vector<std::shared_ptr<SharedScene>> idle;
  const std::unique_lock opening(opening_, std::try_to_lock);
  if (!opening) return idle;
  const std::lock_guard lock(mutex_);
  for (Scene& scene : scenes_)
    if (scene.scene.use_count() > 1) scene.used = now;
  std::erase_if(scenes_, [&](Scene& scene) {
    const bool old = !shelf_.isCurrent(scene.scene->served());
    const bool goes = scene.scene.use_count() == 1 && (old || now - scene.used > kIdleScene);
    if (goes) idle.push_back(std::move(scene.scene));
    return goes;
  });
  return idle;
}

void SessionHouse::keep() {
  std::unique_lock lock(mutex_);
  for (int round = 0; !stopping_; ++round) {
    lock.unlock();
    serveRooms();
    tickers_.observe();
    if (round % 100 == 0) takeIdleScenes();
    lock.lock();
    if (rooms_.empty() && scenes_.empty())
      stop_.wait_for(lock, std::chrono::milliseconds(100), [this] { return stopping_; });
    else
      stop_.wait_for(lock, kHousekeeping, [this] { return stopping_; });
  }
}

SessionFigures SessionHouse::figures() const {
  SessionFigures figures;
  figures.ticker = tickers_.counters();
  const std::lock_guard lock(mutex_);
  figures.open = rooms_.size();
  figures.opened = opened_;
  figures.scenes = scenes_.size();
  for (const Scene& scene : scenes_) figures.tile_bytes += scene.scene->residency().counters().bytes;
  return figures;
}

std::vector<std::string> SessionHouse::takeNotes(const RemoteSession& session) {
  const std::lock_guard lock(mutex_);
  for (Room& room : rooms_)
    if (room.session.get() == &session) return std::exchange(room.notes, {});
  return {};
}

void SessionHouse::tell(const std::string& problem) {
  const std::lock_guard lock(mutex_);
  problems_.push_back("sessions: " + problem);
}

std::vector<std::string> SessionHouse::takeProblems() {
  const std::lock_guard lock(mutex_);
  return std::exchange(problems_, {});
}

}  // namespace filiform::tools
