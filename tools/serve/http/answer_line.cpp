#include "tools/serve/http/answer_line.h"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <iterator>
#include <list>
#include <map>
#include <mutex>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <system_error>
#include <thread>
#include <unistd.h>
#include <utility>

namespace filiform::tools {

namespace {

using LineClock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kLong{20}, kLook{5};
constexpr std::size_t kMostLong = 4;  // long jobs a thread
constexpr int kLongNice = 5;

}  // namespace

struct AnswerLine::Impl {
  struct Waiting {
    Job job;
    std::shared_ptr<const std::atomic<bool>> left;  // nullptr: never
  };
  struct OfClient {
    std::deque<Waiting> jobs;
    unsigned running = 0;
  };
  struct Thread {
    std::thread thread{};
    ::pid_t id = 0;
    bool works = false, is_long = false, ended = false;
    LineClock::time_point began{};
  };

  explicit Impl(unsigned t) : threads(t) {
    const std::lock_guard lock(mutex);
    for (unsigned i = 0; i < threads; ++i) begin();
    watcher = std::thread([this] { watch(); });
  }
  ~Impl() {
    decltype(clients) left;
    {
      const std::lock_guard lock(mutex);
      stopping = true;
      left.swap(clients);
      turns.clear();
    }
    wake.notify_all();
    watched.notify_all();
    left.clear();  // the destructors of jobs may take their time
    watcher.join();
    for (Thread& one : pool) one.thread.join();
  }

  void begin() {
    pool.emplace_back();
    Thread& one = pool.back();
    one.thread = std::thread([this, &one] { work(one); });
  }

  // The first client in turn that may have another job in work.
  std::list<std::string>::iterator next() {
    return std::find_if(turns.begin(), turns.end(),
                        [this](const std::string& name) { return clients.find(name)->second.running < threads; });
  }

  void work(Thread& self) {
    std::unique_lock lock(mutex);
    self.id = static_cast<::pid_t>(::syscall(SYS_gettid));
    while (!self.is_long) {
      auto turn = turns.end();
      wake.wait(lock, [&] { return stopping || (turn = next()) != turns.end(); });
      if (stopping) break;
      const auto client = clients.find(*turn);
      Job job = std::move(client->second.jobs.front().job);
      client->second.jobs.pop_front();
      // The client's next turn comes after those of all others.
      client->second.jobs.empty() ? void(turns.erase(turn)) : turns.splice(turns.end(), turns, turn);
      --count;
      ++client->second.running;
      const std::string name = client->first;
      self.works = true;
      ++running;
      if (parked) watched.notify_one();
      self.began = LineClock::now();
      lock.unlock();
      job();
      job = nullptr;
      lock.lock();
      self.works = false;
      --running;
      if (const auto own = clients.find(name); own != clients.end()) {
        if (--own->second.running == 0 && own->second.jobs.empty())
          clients.erase(own);
        else if (!own->second.jobs.empty())
          wake.notify_one();
      }
    }
    self.ended = true;
    if (self.is_long) --long_jobs;
    if (parked) watched.notify_one();
  }

  // Replaces threads whose jobs are long.
  void watch() {
    std::unique_lock lock(mutex);
    while (!stopping) {
      parked = true;
      watched.wait(lock, [this] { return stopping || running > 0 || hasEnded(); });
      parked = false;
      for (auto one = pool.begin(); one != pool.end();) {
        if (one->ended) one->thread.join();  // it has left its last region under the lock
        one = one->ended ? pool.erase(one) : std::next(one);
      }
      const LineClock::time_point now = LineClock::now();
      for (Thread& one : pool) {
        if (!one.works || one.is_long || now - one.began < kLong || long_jobs >= kMostLong * threads) continue;
        try {
          begin();
        } catch (const std::system_error&) {
          pool.pop_back();  // the system grants no thread: the job keeps this one
          break;
        }
        one.is_long = true;
        ++long_jobs;
        ::setpriority(PRIO_PROCESS, static_cast<::id_t>(one.id), kLongNice);
      }
      watched.wait_for(lock, kLook, [this] { return stopping; });
    }
  }

  bool hasEnded() const {
    return std::any_of(pool.begin(), pool.end(), [](const Thread& one) { return one.ended; });
  }

  const unsigned threads;
  mutable std::mutex mutex;
  std::condition_variable wake, watched;
  std::map<std::string, OfClient> clients;  // with jobs
  std::list<std::string> turns;             // of the clients whose jobs wait
  std::size_t count = 0;                    // of jobs that wait
  std::list<Thread> pool;
  std::size_t running = 0, long_jobs = 0;
  bool stopping = false, parked = false;
  std::thread watcher;
};

AnswerLine::AnswerLine(unsigned threads) : impl_(std::make_unique<Impl>(std::max(1U, threads))) {}

AnswerLine::~AnswerLine() = default;

std::size_t AnswerLine::add(const std::string& client, Job job, std::shared_ptr<const std::atomic<bool>> left) {
  std::deque<Impl::Waiting> kept, gone;  // the destructors of jobs may take their time
  {
    const std::lock_guard lock(impl_->mutex);
    if (impl_->stopping) return 0;
    Impl::OfClient& own = impl_->clients[client];
    if (own.jobs.empty()) impl_->turns.push_back(client);
    for (Impl::Waiting& one : own.jobs) (one.left != nullptr && *one.left ? gone : kept).push_back(std::move(one));
    kept.push_back({std::move(job), std::move(left)});
    own.jobs.swap(kept);
    impl_->count += 1;
    impl_->count -= gone.size();
  }
  impl_->wake.notify_one();
  return gone.size();
}

std::size_t AnswerLine::waiting() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->count;
}

}  // namespace filiform::tools
