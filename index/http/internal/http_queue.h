// HttpQueue: reads that wait for a request. Decides which go next, and which go together.
#pragma once

#include "index/http/internal/http_flight.h"

#include <deque>
#include <optional>
#include <vector>

namespace filiform::internal {

// Thread rule: thread-compatible.
class HttpQueue {
 public:
  static constexpr std::uint64_t kMostGap = 16 << 10;     // bytes between two ranges of one request
  static constexpr std::uint64_t kMostMerged = 4u << 20;  // of a request for several ranges

  void add(HttpJob& job) { jobs_.push_back(&job); }
  bool empty() const { return jobs_.empty(); }
  // Takes the job that has waited longest among those whose wait is over, and all that can share its request. Empty: no
  // job is ready. O(jobs log jobs).
  std::vector<HttpJob*> take(HttpJob::Clock::time_point now);
  // When the next job becomes ready; nullopt: none waits.
  std::optional<HttpJob::Clock::time_point> nextReady() const;
  std::vector<HttpJob*> takeAll();

 private:
  std::deque<HttpJob*> jobs_;  // in the order of arrival
};

}  // namespace filiform::internal
