// ProgressLog: writes a line about running work every few seconds, for a file or a pipe. A thread of its own writes, so
// that lines come during a step that reports nothing. Thread rule: internally synchronised.
#pragma once

#include "tools/program/progress.h"

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>

namespace filiform::tools {

class ProgressLog {
 public:
  // `sink` gets whole lines, on any thread, one at a time. It must not throw. Requires period_s > 0.
  ProgressLog(double period_s, std::function<void(const std::string& line)> sink);
  // Waits for a line that is being written.
  ~ProgressLog() = default;
  ProgressLog(const ProgressLog&) = delete;
  ProgressLog& operator=(const ProgressLog&) = delete;

  // Begins a step. Writes how long the step before took.
  void begin(const ProgressOptions& step);
  // The amount of the step so far; total 0: unknown. `note` is written behind it.
  void update(std::uint64_t done, std::uint64_t total, const std::string& note = {});
  // Ends the last step.
  void end();

 private:
  using Time = std::chrono::steady_clock::time_point;
  void write(std::stop_token stop, double period_s);
  void endStep(Time now);

  std::function<void(const std::string&)> sink_;
  std::mutex mutex_;
  std::condition_variable_any stopped_;
  Time started_, step_started_;
  ProgressOptions step_;  // no title: none
  std::uint64_t done_ = 0;
  std::string note_;
  std::jthread writer_;  // the last member: it uses the others
};

}  // namespace filiform::tools
