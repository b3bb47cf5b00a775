// HttpQueue: reads that wait for a request. Decides which go next, and which go together.
#pragma once

#include "index/remote/internal/http_job.h"

#include <deque>
#include <optional>
#include <vector>

namespace filiform::internal {

// Thread rule: thread-compatible.
class HttpQueue {
 public:
  static constexpr std::uint64_t kMostGap = 24 << 10;  // bytes between two ranges of one request; more from far away
  // Bytes of a request for several ranges, in the background and otherwise (more from far away): the last range waits
  // for the first.
  static constexpr std::uint64_t kMostMerged = 4u << 20, kMostUrgent = 256u << 10;

  // `s`: from a request to its answer. The farther the server, the more bytes one request is worth: from 20 ms on, gaps
  // grow up to 8 times, urgent requests to twice their size.
  void setLatency(double s);
  void add(HttpJob& job) { jobs_.push_back(&job); }
  bool empty() const { return jobs_.empty(); }
  // Takes the job that has waited longest among those whose wait is over, and all that can share its request, among
  // them those that only gather. Jobs of the background come after all others, and never share a request with them.
  // Empty: no job is ready. O(jobs log jobs). Without `background`, these jobs stay in the queue.
  std::vector<HttpJob*> take(HttpJob::Clock::time_point now, bool background = true);
  // When the next job becomes ready; nullopt: none waits. Without `background`, jobs of the background do not count.
  std::optional<HttpJob::Clock::time_point> nextReady(bool background = true) const;
  std::vector<HttpJob*> takeAll();

 private:
  std::deque<HttpJob*> jobs_;  // in the order of arrival
  std::uint64_t most_gap_ = kMostGap, most_urgent_ = kMostUrgent;
};

}  // namespace filiform::internal
