// Progress of running work on stderr: a line on a terminal with amount done, rate and time left, or JSON lines for
// other programs. Thread rule: thread-compatible; setProgressStyle() before other threads start.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>

namespace filiform::tools {

enum class ProgressUnit { count, bytes };

enum class ProgressStyle {
  automatic,  // a line on stderr if it is a terminal, otherwise nothing
  json,       // one JSON object a line on stderr; tools/README.md lists the fields
  none,
};
// The style of all objects that are made later with the first constructor.
void setProgressStyle(ProgressStyle style);

struct ProgressOptions {
  std::string title;  // "ingest"
  std::string noun;   // "cells"; unused with bytes
  ProgressUnit unit = ProgressUnit::count;
  std::uint64_t total = 0;  // 0: unknown; the line then has no bar and no time left
};

class Progress {
 public:
  using Clock = std::function<std::chrono::steady_clock::time_point()>;
  using Sink = std::function<void(const std::string& text)>;

  // Writes to stderr, as the style says.
  explicit Progress(ProgressOptions options);
  // For tests: writes to `sink` and takes the time from `clock`.
  Progress(ProgressOptions options, Sink sink, Clock clock, int columns, bool json = false);
  // Removes the line.
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  // `done`: the amount so far. Cheap enough for every item: most calls only count. The line changes at most ten times a
  // second.
  void update(std::uint64_t done) {
    done_ = done;
    if (sink_ && ++calls_ >= calls_between_) refresh();
  }
  void setTotal(std::uint64_t total) { options_.total = total; }
  // Removes the line, so that results begin on an empty one. With JSON, writes the last amount.
  void finish();

  // `counting_s`: time since the amount was last 0.
  // Returns amount, total, rate and time left: "250 of 1 000 cells, 25/s, 30 s left".
  static std::string amounts(const ProgressOptions& options, std::uint64_t done, double counting_s);
  // Returns the line for this state: no control characters, at most `columns` wide.
  static std::string line(const ProgressOptions& options, std::uint64_t done, double counting_s, int columns);
  // Returns the JSON object for this state, with a newline. `elapsed_s`: time since the step began.
  static std::string jsonLine(const ProgressOptions& options, std::uint64_t done, double elapsed_s, double counting_s);

 private:
  std::string jsonLine(std::chrono::steady_clock::time_point now) const;
  void refresh();

  ProgressOptions options_;
  Sink sink_;
  Clock clock_;
  int columns_ = 80;
  std::chrono::steady_clock::time_point started_, shown_;
  std::chrono::steady_clock::time_point counting_;  // when the amount was last seen at 0: rate and time left begin here
  std::uint64_t done_ = 0;
  std::uint64_t calls_ = 0, calls_between_ = 1;
  bool visible_ = false;
  bool json_ = false, ended_ = false;
};

}  // namespace filiform::tools
