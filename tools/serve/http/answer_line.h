// AnswerLine: the requests that wait for an answer, and the threads that answer. Clients take turns: one client's
// requests never wait for all those of another.
//
//   AnswerLine line(2);
//   line.add("192.0.2.7", [] { ... });
//
// A client has at most `threads` jobs in work. A job that runs for more than 20 ms gives its place to another thread,
// and goes on at a lower priority; up to four times `threads` such jobs run beside the others. So a short question is
// soon answered, also beside long ones and beside a store that does not answer. Thread rule: internally synchronised.
// Jobs must not throw.
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>

namespace filiform::tools {

class AnswerLine {
 public:
  using Job = std::function<void()>;

  explicit AnswerLine(unsigned threads);
  // Discards the jobs that wait, and waits for those in work.
  ~AnswerLine();

  // Adds a job to the client's own line. `left` becomes true when nobody waits for the job any more. Discards the jobs
  // in this line that nobody waits for, and returns their number. O(log clients + jobs in the line).
  std::size_t add(const std::string& client, Job job, std::shared_ptr<const std::atomic<bool>> left = nullptr);
  // The jobs that wait now.
  std::size_t waiting() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform::tools
