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

constexpr std::size_t kToursOfClient = 8;  // routes that a client travels in turn
constexpr double kHandRate_Hz = 100, kModelRate_Hz = 20;

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
  SessionServer(const std::string& set, std::uint64_t budget_bytes)
      : shelf_(shelfEntries({set}), std::uint64_t{256} << 20),
        house_(shelf_, {.budget_bytes = budget_bytes, .most_sessions = 1000}),
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

struct TourFigures {
  double late = 0, bare_late = 0;  // shares
  double busiest = 0;              // PROXY frames of the busiest session over those of the least served
  double round_p50_us = 0, round_p99_us = 0;
  double memory_from_MiB = 0, memory_to_MiB = 0, tiles_MiB = 0;
  double waiting = 0;  // share of PROXY frames at absent tiles
  double travelled_um = 0, longest_us = 0, hands_Hz = 0;
  std::uint64_t replaced = 0, legs = 0;
};

TourFigures measureTour(const TileSet& set, const std::string& path, std::size_t sessions, double seconds,
                        std::uint64_t budget_bytes, const BenchOptions& options) {
  // Planned before a client connects: the server ends a client that is silent meanwhile.
  std::vector<std::vector<filiform::Route>> planned(sessions);
  for (std::size_t i = 0; i < sessions; ++i) {
    Tour routes(set, options.seed + i);
    for (std::size_t k = 0; k < kToursOfClient; ++k) planned[i].push_back(routes.next());
  }
  SessionServer server(path, budget_bytes);
  std::vector<std::unique_ptr<TouringClient>> clients;
  for (std::vector<filiform::Route>& routes : planned)
    clients.push_back(std::make_unique<TouringClient>(server.port(), server.set(), std::move(routes), kModelRate_Hz));
  const std::size_t threads = std::max<std::size_t>(1, std::min<std::size_t>(sessions, 2));
  const double warm_s = std::min(3.0, seconds / 2);
  std::atomic<bool> stop{false};
  std::atomic<int> failed{0};
  std::vector<std::jthread> drivers;
  const std::int64_t begin_ns = sessionsNow_ns();
  for (std::size_t t = 0; t < threads; ++t)
    drivers.emplace_back([&, t] {
      try {
        for (std::int64_t round = 0; !stop; ++round)
          for (std::size_t i = t; i < clients.size() && !stop; i += threads) {
            const double due_s =
                (static_cast<double>(round) + static_cast<double>(i) / static_cast<double>(sessions)) / kHandRate_Hz;
            const std::int64_t due_ns = begin_ns + static_cast<std::int64_t>(1e9 * due_s);
            std::this_thread::sleep_for(std::chrono::nanoseconds(std::max<std::int64_t>(0, due_ns - sessionsNow_ns())));
            clients[i]->step(sessionsNow_ns());
          }
      } catch (const std::exception&) {
        ++failed;
      }
    });
  std::this_thread::sleep_for(std::chrono::duration<double>(warm_s));
  TourFigures figures;
  figures.memory_from_MiB = residentMiB();
  const TickerCounters from = server.house().figures().ticker;
  {
    const BareTimer bare;
    const auto until = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
    while (std::chrono::steady_clock::now() < until) {
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
      figures.tiles_MiB =
          std::max(figures.tiles_MiB, static_cast<double>(server.house().figures().tile_bytes) / (1 << 20));
    }
    figures.bare_late = static_cast<double>(bare.late()) / static_cast<double>(std::max<std::uint64_t>(1, bare.due()));
  }
  const TickerCounters to = server.house().figures().ticker;
  figures.memory_to_MiB = residentMiB();
  stop = true;
  drivers.clear();
  if (failed > 0) throw std::runtime_error("bench sessions: a connection ended");
  figures.late =
      static_cast<double>(to.late - from.late) / static_cast<double>(std::max<std::uint64_t>(1, to.due - from.due));
  figures.longest_us = static_cast<double>(to.longest_us);
  std::vector<double> round_us, proxies;
  double waiting = 0, all = 0, hands = 0;
  for (auto& client : clients) {
    round_us.insert(round_us.end(), client->roundTrips_us().begin(), client->roundTrips_us().end());
    proxies.push_back(static_cast<double>(client->proxies()));
    waiting += static_cast<double>(client->waiting());
    all += static_cast<double>(client->proxies());
    hands += static_cast<double>(client->hands());
    figures.travelled_um += client->travelled_um();
    figures.replaced += client->replaced();
    figures.legs += client->legs();
  }
  figures.hands_Hz = hands / static_cast<double>(sessions) / (warm_s + seconds);
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
  const std::uint64_t budget_bytes = std::uint64_t{256} << 20;

  BenchReport report;
  BenchTable table{"tours",
                   "sessions touring " + std::to_string(set->segmentCount()) +
                       " segments, HAND at 100 Hz, ticks at 1 kHz, "
                       "LOCAL MODEL at 20 Hz, tiles within 256 MiB, clients read every 10 ms; " +
                       std::to_string(static_cast<int>(seconds)) + " s",
                   {"sessions", "late %", "bare timer late %", "busiest/least", "round trip p50 us", "p99 us",
                    "waiting %", "memory before MiB", "after MiB", "tiles MiB", "longest round us", "HAND Hz", "legs"},
                   {}};
  for (const std::size_t sessions : {std::size_t{1}, std::size_t{30}, std::size_t{100}}) {
    options.progress(std::to_string(sessions) + " sessions");
    const TourFigures f = measureTour(*set, path, sessions, seconds, budget_bytes, options);
    table.rows.push_back({static_cast<std::int64_t>(sessions), 100 * f.late, 100 * f.bare_late, f.busiest,
                          f.round_p50_us, f.round_p99_us, 100 * f.waiting, f.memory_from_MiB, f.memory_to_MiB,
                          f.tiles_MiB, f.longest_us, f.hands_Hz, static_cast<std::int64_t>(f.legs)});
    const double more = 100 * (f.late - f.bare_late);
    if (sessions == 30)
      report.goals.push_back({"30 sessions: late ticks above those of a bare timer, percentage points", "<= 1",
                              "<= 0.2", more, more <= 1, more <= 0.2});
    if (sessions != 100) continue;
    const double growth = 100 * (f.memory_to_MiB / f.memory_from_MiB - 1);
    report.goals.push_back(
        {"100 sessions: growth of memory in the run, %", "<= 2", "<= 1", growth, growth <= 2, growth <= 1});
    report.goals.push_back({"100 sessions: frames of the busiest over the least served", "<= 1.2", "<= 1.05", f.busiest,
                            f.busiest <= 1.2, f.busiest <= 1.05});
  }
  report.tables.push_back(std::move(table));
  return report;
}

}  // namespace

void addSessionsWorkloads(std::vector<Workload>& all) {
  all.push_back({"sessions", "many sessions of the service that tour a set, beside a bare timer", runSessions});
}

}  // namespace filiform::tools
