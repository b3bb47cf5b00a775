// Quotas: how many requests a minute a person may send, and how many wrong tokens a client.
//
//   Quotas quotas;
//   if (const unsigned wait_s = quotas.take("ann", 600)) refuse();    // ask again after this time
//
// Thread rule: internally synchronised.
#pragma once

#include <chrono>
#include <cstddef>
#include <map>
#include <mutex>
#include <string>

namespace filiform::tools {

class Quotas {
 public:
  using Clock = std::chrono::steady_clock;

  // Takes one of the requests that `name` may send: as many at once as a minute has, and then evenly. Returns 0, or the
  // seconds until the next one, if none is left. A limit of 0: none. O(log names).
  unsigned take(const std::string& name, unsigned per_minute, Clock::time_point now = Clock::now());
  // Counts one, and returns those of `name` in its present minute. O(log names).
  unsigned count(const std::string& name, Clock::time_point now = Clock::now());

 private:
  static constexpr std::size_t kMostNames =
      4096;  // beyond that, those of earlier minutes are forgotten; beyond twice that, all
  struct Used {
    double left = 0;
    unsigned counted = 0;
    Clock::time_point since{};
  };
  Used& used(const std::string& name, Clock::time_point now);

  std::mutex mutex_;
  std::map<std::string, Used> used_;
};

}  // namespace filiform::tools
