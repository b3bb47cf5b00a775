#include "tools/program/progress_log.h"

#include <cstdio>
#include <utility>

namespace filiform::tools {
namespace {

std::string withTenths(double seconds) {
  char text[40];
  std::snprintf(text, sizeof text, "%.1f s", seconds);
  return text;
}

double secondsBetween(std::chrono::steady_clock::time_point from, std::chrono::steady_clock::time_point to) {
  return std::chrono::duration<double>(to - from).count();
}

}  // namespace

ProgressLog::ProgressLog(double period_s, std::function<void(const std::string& line)> sink)
    : sink_(std::move(sink)), started_(std::chrono::steady_clock::now()), step_started_(started_) {
  writer_ = std::jthread([this, period_s](std::stop_token stop) { write(std::move(stop), period_s); });
}

void ProgressLog::begin(const ProgressOptions& step) {
  const std::lock_guard lock(mutex_);
  const Time now = std::chrono::steady_clock::now();
  endStep(now);
  step_ = step;
  step_started_ = now;
  done_ = 0;
  note_.clear();
}

void ProgressLog::update(std::uint64_t done, std::uint64_t total, const std::string& note) {
  const std::lock_guard lock(mutex_);
  done_ = done;
  step_.total = total;
  note_ = note;
}

void ProgressLog::end() {
  const std::lock_guard lock(mutex_);
  endStep(std::chrono::steady_clock::now());
}

void ProgressLog::endStep(Time now) {
  if (step_.title.empty()) return;
  sink_(step_.title + ": done in " + withTenths(secondsBetween(step_started_, now)) + ", " +
        withTenths(secondsBetween(started_, now)) + " in all\n");
  step_ = {};
}

void ProgressLog::write(std::stop_token stop, double period_s) {
  const auto period =
      std::chrono::duration_cast<std::chrono::steady_clock::duration>(std::chrono::duration<double>(period_s));
  std::unique_lock lock(mutex_);
  for (Time next = started_ + period;; next += period) {
    if (stopped_.wait_until(lock, stop, next, [] { return false; }) || stop.stop_requested()) return;
    if (step_.title.empty()) continue;
    const Time now = std::chrono::steady_clock::now();
    std::string line = step_.title + ": " + Progress::amounts(step_, done_, secondsBetween(step_started_, now));
    if (!note_.empty()) line += ", " + note_;
    sink_(line + "; " + withTenths(secondsBetween(started_, now)) + " in all\n");
  }
}

}  // namespace filiform::tools
