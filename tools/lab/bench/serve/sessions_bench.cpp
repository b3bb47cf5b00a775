// bench sessions: many sessions that tour a set over WebSockets, beside a bare timer of 1 kHz in the same run.
#include "index/ingest/ingest.h"
#include "index/set/tile_set.h"
#include "solver/travel/routes/tour.h"
#include "tools/lab/bench/index/dense_cells.h"
#include "tools/lab/bench/serve/touring_client.h"
#include "tools/lab/bench/workloads.h"
#include "tools/serve/http/server.h"
#include "tools/serve/routes/routes.h"
#include "tools/serve/session/session_house.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <memory>
#include <pthread.h>
#include <sched.h>
#include <stdexcept>
#include <string>
#include <thread>
#include <unistd.h>

namespace filiform::tools {

namespace {

constexpr std::size_t kToursOfClient = 4;  // routes that a client travels in turn
constexpr double kHandRate_Hz = 100, kModelRate_Hz = 20;
constexpr std::uint64_t kTiles_bytes = std::uint64_t{2} << 30;  // the whole set of this workload is in memory

std::int64_t sessionsNow_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

double residentMiB() {
  std::ifstream statm("/proc/self/statm");
  std::uint64_t whole = 0, resident = 0;
  statm >> whole >> resident;
  return static_cast<double>(resident) * static_cast<double>(::sysconf(_SC_PAGESIZE)) / (1 << 20);
}

// A thread that only wakes a thousand times a second, with the priority of the sessions' ticker.
class BareTimer {
 public:
  BareTimer() : thread_([this] { run(); }) {}
  ~BareTimer() {
    stop_ = true;
    thread_.join();
  }
  std::uint64_t due() const { return due_; }
  std::uint64_t late() const { return late_; }

 private:
  void run() {
    sched_param parameters{};
    parameters.sched_priority = 40;
    ::pthread_setschedparam(::pthread_self(), SCHED_FIFO, &parameters);
    const std::int64_t begin_ns = sessionsNow_ns();
    std::int64_t period = 0;
    while (!stop_) {
      const std::int64_t due_ns = begin_ns + (period + 1) * 1'000'000;
      const timespec when{static_cast<time_t>(due_ns / 1'000'000'000), static_cast<long>(due_ns % 1'000'000'000)};
      ::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &when, nullptr);
      const std::int64_t reached = std::max(period + 1, (sessionsNow_ns() - begin_ns) / 1'000'000);
      due_ += static_cast<std::uint64_t>(reached - period);
      late_ += static_cast<std::uint64_t>(reached - period - 1);  // left out: it woke more than a period late
      period = reached;
    }
  }
  std::atomic<bool> stop_{false};
  std::atomic<std::uint64_t> due_{0}, late_{0};
  std::thread thread_;
};

class SessionServer {
 public:
  SessionServer(const std::string& set, std::size_t threads)
      : shelf_(shelfEntries({set}), std::uint64_t{256} << 20),
        house_(shelf_, {.budget_bytes = kTiles_bytes, .most_sessions = 1000, .threads = threads}),
        server_(routes_, metrics_, options()),
        thread_([this] { server_.run(); }) {}
  ~SessionServer() {
    stop_ = true;
    thread_.join();
  }
  SessionHouse& house() { return house_; }
  std::string set() const { return shelf_.all().front()->name(); }
  std::uint16_t port() const {
    return static_cast<std::uint16_t>(std::stoi(server_.address().substr(server_.address().rfind(':') + 1)));
  }

 private:
  ServerOptions options() {
    ServerOptions options{.listen = "127.0.0.1:0", .most_clients = 2000, .threads = 1};
    options.stop = &stop_;
    options.sessions = &house_;
    return options;
  }
  std::atomic<bool> stop_{false};
  SetShelf shelf_;
  SessionHouse house_;
  Access access_{AccessRules{}};
  Metrics metrics_;
  const Service service_{shelf_, access_, metrics_, ""};
  const Routes routes_{service_, [](const std::string&) {}};
  Server server_;
  std::thread thread_;
};

struct TourPlan {
  std::size_t threads = 1;   // of the server, that tick sessions
  std::size_t sessions = 1;  // at most; fewer if the server refuses one
  bool parted = false;       // the server on the first core, the clients on the second
  double seconds = 30;
};

struct TourFigures {
  std::size_t sessions = 0;
  double late = 0, bare_late = 0;  // shares
  double busy = 0;                 // processor time of the ticking threads over the time
  double busiest = 0;              // PROXY frames for a HAND: the best served session over the least served one
  double round_p50_us = 0, round_p99_us = 0;
  double memory_from_MiB = 0, memory_to_MiB = 0, tiles_MiB = 0;
  double waiting = 0;  // share of PROXY frames at absent tiles
  double longest_us = 0;
  std::uint64_t legs = 0;
};

void useCore(int core) {
  cpu_set_t cores;
  CPU_ZERO(&cores);
  CPU_SET(core, &cores);
  static_cast<void>(::sched_setaffinity(0, sizeof cores, &cores));
}

// The clients of a server, each of which travels. Clients are added while others travel.
class TouringClients {
 public:
  TouringClients(std::size_t most, bool on_second_core) {
    clients_.reserve(most);
    for (std::size_t t = 0; t < 2; ++t)
      drivers_.emplace_back([this, t, on_second_core] {
        if (on_second_core) useCore(1);
        drive(t);
      });
  }
  ~TouringClients() { stop(); }
  void add(std::unique_ptr<TouringClient> client) {
    clients_.push_back(std::move(client));
    count_ = clients_.size();
  }
  // Returns false if a connection ended.
  bool stop() {
    stop_ = true;
    drivers_.clear();
    return failed_ == 0;
  }
  std::vector<std::unique_ptr<TouringClient>>& all() { return clients_; }

 private:
  void drive(std::size_t t) {
    try {
      const std::int64_t begin_ns = sessionsNow_ns();
      for (std::int64_t round = 0; !stop_; ++round) {
        const std::size_t count = count_;
        if (count <= t) std::this_thread::sleep_for(std::chrono::milliseconds(10));
        for (std::size_t i = t; i < count && !stop_; i += 2) {
          const double due_s =
              (static_cast<double>(round) + static_cast<double>(i) / static_cast<double>(count)) / kHandRate_Hz;
          const std::int64_t due_ns = begin_ns + static_cast<std::int64_t>(1e9 * due_s);
          std::this_thread::sleep_for(std::chrono::nanoseconds(std::max<std::int64_t>(0, due_ns - sessionsNow_ns())));
          clients_[i]->step(sessionsNow_ns());
        }
      }
    } catch (const std::exception&) {
      ++failed_;
    }
  }
  std::vector<std::unique_ptr<TouringClient>> clients_;  // does not grow beyond its room: drivers read it
  std::atomic<std::size_t> count_{0};
  std::atomic<bool> stop_{false};
  std::atomic<int> failed_{0};
  std::vector<std::jthread> drivers_;
};

TourFigures measureTour(const TileSet& set, const std::string& path, const TourPlan& plan,
                        const BenchOptions& options) {
  cpu_set_t before;
  ::sched_getaffinity(0, sizeof before, &before);
  if (plan.parted) useCore(0);  // of the server's threads too
  SessionServer server(path, plan.threads);
  TouringClients clients(plan.sessions, plan.parted);
  if (plan.parted) useCore(1);
  for (std::size_t i = 0; i < plan.sessions; ++i) {
    // Planned before the client connects: the server ends a client that is silent meanwhile.
    std::vector<filiform::Route> routes;
    for (Tour tour(set, options.seed + i); routes.size() < kToursOfClient;) routes.push_back(tour.next());
    // The figures of a thread are half a second old at most: a refusal that stays is the server's limit.
    std::unique_ptr<TouringClient> client;
    for (int tries = 0; client == nullptr && tries < 3; ++tries) {
      try {
        client = std::make_unique<TouringClient>(server.port(), server.set(), routes, kModelRate_Hz);
      } catch (const std::runtime_error& refused) {
        if (std::string(refused.what()).find("the sessions of this server") == std::string::npos) throw;
        std::this_thread::sleep_for(std::chrono::milliseconds(700));
      }
    }
    if (client == nullptr) break;
    clients.add(std::move(client));
    std::this_thread::sleep_for(std::chrono::milliseconds(options.quick ? 20 : 200));
  }
  std::this_thread::sleep_for(std::chrono::duration<double>(std::min(3.0, plan.seconds / 2)));
  TourFigures figures;
  figures.memory_from_MiB = residentMiB();
  const TickerCounters from = server.house().figures().ticker;
  const std::int64_t from_ns = sessionsNow_ns();
  {
    const BareTimer bare;
    const auto until = std::chrono::steady_clock::now() + std::chrono::duration<double>(plan.seconds);
    while (std::chrono::steady_clock::now() < until) {
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
      figures.tiles_MiB =
          std::max(figures.tiles_MiB, static_cast<double>(server.house().figures().tile_bytes) / (1 << 20));
    }
    figures.bare_late = static_cast<double>(bare.late()) / static_cast<double>(std::max<std::uint64_t>(1, bare.due()));
  }
  const TickerCounters to = server.house().figures().ticker;
  const double took_ns = static_cast<double>(sessionsNow_ns() - from_ns);
  figures.memory_to_MiB = residentMiB();
  ::sched_setaffinity(0, sizeof before, &before);
  if (!clients.stop()) throw std::runtime_error("bench sessions: a connection ended");
  figures.sessions = clients.all().size();
  figures.busy = static_cast<double>(to.busy_ns - from.busy_ns) / took_ns;
  figures.late =
      static_cast<double>(to.late - from.late) / static_cast<double>(std::max<std::uint64_t>(1, to.due - from.due));
  figures.longest_us = static_cast<double>(to.longest_us);
  std::vector<double> round_us, proxies;
  double waiting = 0, all = 0;
  for (auto& client : clients.all()) {
    round_us.insert(round_us.end(), client->roundTrips_us().begin(), client->roundTrips_us().end());
    proxies.push_back(static_cast<double>(client->proxies()) / static_cast<double>(client->hands()));
    waiting += static_cast<double>(client->waiting());
    all += static_cast<double>(client->proxies());
    figures.legs += client->legs();
  }
  figures.busiest = *std::max_element(proxies.begin(), proxies.end()) /
                    std::max(1.0, *std::min_element(proxies.begin(), proxies.end()));
  figures.waiting = waiting / std::max(1.0, all);
  figures.round_p50_us = percentile(round_us, 0.5);
  figures.round_p99_us = percentile(round_us, 0.99);
  return figures;
}

BenchReport runSessions(const BenchOptions& options) {
  const WorkFolder folder(options.out, "sessions");
  std::string path = options.scene;
  if (path.empty()) {
    const std::uint64_t segments = options.segments != 0 ? options.segments : options.quick ? 20'000 : 10'000'000;
    options.progress("a set of " + std::to_string(segments) + " segments");
    const std::vector<Cell> library = morphologyLibrary(options.corpus, options.quick ? 4 : 60, options.seed);
    DenseCells cells(library, segments, kPerUm3, options.seed);
    path = folder.path() + "/dense.fil";
    ingest(cells, path);
  }
  const auto set = TileSet::open(path);
  const double seconds = options.quick ? 1 : options.long_run ? 600 : 30;

  BenchReport report;
  BenchTable table{
      "tours",
      "sessions touring " + std::to_string(set->segmentCount()) +
          " segments, all hands moving, HAND at 100 Hz, ticks at 1 kHz, LOCAL MODEL at 20 Hz, tiles within "
          "2 GiB, as many sessions as the server takes; " +
          std::to_string(static_cast<int>(seconds)) + " s",
      {"hands on", "threads", "sessions", "late %", "bare timer late %", "CPU of a hand ms/s", "busiest/least",
       "round trip p50 us", "p99 us", "waiting %", "memory before MiB", "after MiB", "tiles MiB", "longest round us",
       "legs"},
      {}};
  const std::size_t many = options.quick ? 6 : 200;
  for (const TourPlan& plan :
       {TourPlan{1, 1, true, seconds}, TourPlan{1, many, true, seconds}, TourPlan{2, many, false, seconds}}) {
    options.progress("at most " + std::to_string(plan.sessions) + " sessions on " + std::to_string(plan.threads) +
                     " threads");
    const TourFigures f = measureTour(*set, path, plan, options);
    const double hand_ms = 1e3 * f.busy / static_cast<double>(f.sessions), more = 100 * (f.late - f.bare_late);
    const std::string on = plan.sessions == 1 ? "1 core, one" : plan.threads == 1 ? "1 core" : "2 cores";
    table.rows.push_back({on, static_cast<std::int64_t>(plan.threads), static_cast<std::int64_t>(f.sessions),
                          100 * f.late, 100 * f.bare_late, hand_ms, f.busiest, f.round_p50_us, f.round_p99_us,
                          100 * f.waiting, f.memory_from_MiB, f.memory_to_MiB, f.tiles_MiB, f.longest_us,
                          static_cast<std::int64_t>(f.legs)});
    if (plan.sessions == 1) continue;
    const auto taken = static_cast<double>(f.sessions), wanted = 10.0 * static_cast<double>(plan.threads);
    report.goals.push_back(
        {on + ": moving hands that the server takes", ">= " + std::to_string(static_cast<int>(wanted)),
         ">= " + std::to_string(static_cast<int>(1.5 * wanted)), taken, taken >= wanted, taken >= 1.5 * wanted});
    report.goals.push_back(
        {on + ": processor time of a hand, ms a second", "<= 47", "<= 30", hand_ms, hand_ms <= 47, hand_ms <= 30});
    report.goals.push_back({on + ": late ticks above those of a bare timer, percentage points", "<= 1", "<= 0.2", more,
                            more <= 1, more <= 0.2});
  }
  report.tables.push_back(std::move(table));
  return report;
}

}  // namespace

void addSessionsWorkloads(std::vector<Workload>& all) {
  all.push_back({"sessions", "many sessions of the service that tour a set, beside a bare timer", runSessions});
}

}  // namespace filiform::tools
