// Metrics: what the service counts, as Prometheus reads it. Thread rule: internally synchronised.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <ctime>
#include <map>
#include <mutex>
#include <string>
#include <utility>

namespace filiform::tools {

class SetShelf;
struct Person;

class Metrics {
 public:
  // One answered request. `route`: the template of its path, such as /v1/sets/{set}; empty: none. `entry`: that of the
  // person in the file of --tokens; empty: none.
  void count(const std::string& route, unsigned status, double seconds, std::uint64_t bytes_in, std::uint64_t bytes_out,
             const std::string& entry = {});

  std::atomic<std::uint64_t> connections{0};          // open now
  std::atomic<std::uint64_t> refused_connections{0};  // because of --max-clients
  std::atomic<bool> draining{false};                  // the server ends soon
  std::atomic<std::uint64_t> answer_bytes{0};         // of large answers in memory now
  std::atomic<std::uint64_t> waiting{0};              // requests in the line now
  std::atomic<std::uint64_t> refused_tokens{0};       // requests without the token, or with a wrong one
  std::atomic<std::uint64_t> slowed_tokens{0};        // those of them after many wrong ones in a minute
  std::atomic<std::uint64_t> refused_quotas{0};       // requests beyond a person's quota
  std::atomic<std::uint64_t> unreadable{0};           // answers that failed at a damaged or missing part of a set
  std::atomic<std::uint64_t> left_answers{0};         // that nobody waited for any more
  // WebSockets open now; ticks of sessions so far, those of them that were late; tiles of sessions in memory now.
  std::atomic<std::uint64_t> sessions{0}, session_ticks{0}, session_late_ticks{0}, session_busy_ms{0},
      session_tile_bytes{0};

  // Prometheus text, version 0.0.4. `version`: of the program. `who`: gets the lines of sets that this person may know
  // of, and the lines of people if these are all sets, else the own line.
  std::string text(const SetShelf& shelf, const std::string& version, const Person& who) const;

 private:
  static constexpr std::array<double, 9> kBounds_s{0.0001, 0.0003, 0.001, 0.003, 0.01, 0.03, 0.1, 1, 5};
  mutable std::mutex mutex_;
  struct Durations {
    std::array<std::uint64_t, kBounds_s.size() + 1> counts{};  // by first bound that is not smaller
    double seconds = 0;                                        // of all
  };
  static constexpr std::size_t kMostEntries = 1000;                     // the others count as "other"
  std::map<std::pair<std::string, unsigned>, std::uint64_t> requests_;  // by route and status
  std::map<std::string, std::uint64_t> people_;                         // requests, by entry
  std::map<std::string, Durations> durations_;                          // by route
  const std::time_t began_ = std::time(nullptr);
  std::uint64_t bytes_in_ = 0, bytes_out_ = 0;
};

}  // namespace filiform::tools
