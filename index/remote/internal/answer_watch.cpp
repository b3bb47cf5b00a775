#include "index/remote/internal/answer_watch.h"

namespace filiform::internal {

void AnswerWatch::readBegins(Clock::time_point now) {
  if (reads_++ == 0 && !has_failed_) silent_since_ = now;
}

void AnswerWatch::answered(Clock::time_point asked, Clock::time_point now) {
  if (has_failed_ && asked < failed_) return;
  has_failed_ = false;
  silent_since_ = now;
}

void AnswerWatch::unanswered(Clock::time_point now) {
  if (!has_failed_ && reads_ == 0) silent_since_ = now;
  has_failed_ = true;
  failed_ = now;
}

void AnswerWatch::describe(RemoteCounters& counters, Clock::time_point now) const {
  counters.lost = has_failed_ && now - failed_ < kFailureLasts;
  counters.silent_s = 0;
  if (counters.lost || reads_ > 0) counters.silent_s = std::chrono::duration<double>(now - silent_since_).count();
}

}  // namespace filiform::internal
