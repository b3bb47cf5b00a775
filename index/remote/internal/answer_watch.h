// AnswerWatch: tells from the answers of a server whether the network is slow or lost. Thread rule: thread-compatible.
#pragma once

#include "index/file/remote_counters.h"

#include <chrono>

namespace filiform::internal {

class AnswerWatch {
 public:
  using Clock = std::chrono::steady_clock;
  // A failure counts for this time: reads that failed are tried again sooner.
  static constexpr std::chrono::seconds kFailureLasts{12};

  void readBegins(Clock::time_point now);
  void readEnds() { --reads_; }
  // `asked`: when this request was sent. An answer to one sent before a failure says nothing of the network since.
  void answered(Clock::time_point asked, Clock::time_point now);
  void unanswered(Clock::time_point now);  // no connection, or no answer in time

  // Sets `silent_s` and `lost`.
  void describe(RemoteCounters& counters, Clock::time_point now) const;

 private:
  int reads_ = 0;                     // that wait
  Clock::time_point silent_since_{};  // the last answer, the first failure after it, or when a first read began to wait
  Clock::time_point failed_{};
  bool has_failed_ = false;  // since the last answer
};

}  // namespace filiform::internal
