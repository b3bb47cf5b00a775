#include "tools/program/progress.h"

#include "index/count_text.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <sys/ioctl.h>
#include <unistd.h>
#include <utility>

#include <nlohmann/json.hpp>

namespace filiform::tools {

namespace {

constexpr auto kBetweenLines = std::chrono::milliseconds(100);

ProgressStyle chosen_style = ProgressStyle::automatic;

std::string scaledBytes(double bytes) {
  static constexpr const char* kUnits[] = {"B", "KiB", "MiB", "GiB", "TiB"};
  std::size_t unit = 0;
  for (; bytes >= 1024 && unit + 1 < std::size(kUnits); ++unit) bytes /= 1024;
  char text[40];
  std::snprintf(text, sizeof text, unit == 0 ? "%.0f %s" : "%.1f %s", bytes, kUnits[unit]);
  return text;
}

std::string duration(double seconds) {
  const auto s = static_cast<long long>(std::ceil(std::min(seconds, 3.6e6)));
  char text[40];
  if (s >= 3600) {
    std::snprintf(text, sizeof text, "%lld h %02lld min", s / 3600, s / 60 % 60);
  } else if (s >= 60) {
    std::snprintf(text, sizeof text, "%lld min %02lld s", s / 60, s % 60);
  } else {
    std::snprintf(text, sizeof text, "%lld s", s);
  }
  return text;
}

// Seconds until all is done at the rate so far. Nothing if that is not known.
std::optional<double> timeLeft_s(const ProgressOptions& options, std::uint64_t done, double counting_s) {
  if (options.total == 0 || done == 0 || !(counting_s > 0)) return std::nullopt;
  const double to_do = options.total > done ? static_cast<double>(options.total - done) : 0;
  return to_do / static_cast<double>(done) * counting_s;
}

double roundedToMilliseconds(double seconds) { return std::round(seconds * 1e3) / 1e3; }

int terminalColumns() {
  winsize size{};
  return ::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
}

}  // namespace

void setProgressStyle(ProgressStyle style) { chosen_style = style; }

Progress::Progress(ProgressOptions options)
    : options_(std::move(options)), clock_([] { return std::chrono::steady_clock::now(); }) {
  started_ = shown_ = counting_ = clock_();
  json_ = chosen_style == ProgressStyle::json;
  if (chosen_style == ProgressStyle::none || (!json_ && ::isatty(STDERR_FILENO) == 0)) return;
  columns_ = terminalColumns();
  sink_ = [](const std::string& text) {
    std::fwrite(text.data(), 1, text.size(), stderr);
    std::fflush(stderr);
  };
}

Progress::Progress(ProgressOptions options, Sink sink, Clock clock, int columns, bool json)
    : options_(std::move(options)), sink_(std::move(sink)), clock_(std::move(clock)), columns_(columns), json_(json) {
  started_ = shown_ = counting_ = clock_();
}

Progress::~Progress() {
  try {
    finish();
  } catch (...) {
    // A progress line that cannot be removed does not end the program.
  }
}

void Progress::refresh() {
  calls_ = 0;
  const auto now = clock_();
  if (done_ == 0) counting_ = now;  // what comes before, such as listing an archive, says nothing about the rate
  const auto since = now - shown_;
  // Look at the clock after so many calls that the look costs almost nothing.
  if (since < kBetweenLines / 8) {
    calls_between_ = std::min<std::uint64_t>(calls_between_ * 2, 1U << 12);
  } else if (since > kBetweenLines) {
    calls_between_ = std::max<std::uint64_t>(calls_between_ / 4, 1);
  }
  if (since < kBetweenLines) return;
  shown_ = now;
  if (json_) return sink_(jsonLine(now));
  visible_ = true;
  const double counting_s = std::chrono::duration<double>(now - counting_).count();
  sink_("\r" + line(options_, done_, counting_s, columns_ - 1) + "\x1b[K");
}

void Progress::finish() {
  if (json_ && sink_ && !std::exchange(ended_, true)) sink_(jsonLine(clock_()));
  if (visible_) sink_("\r\x1b[K");
  visible_ = false;
}

std::string Progress::amounts(const ProgressOptions& options, std::uint64_t done, double counting_s) {
  const bool bytes = options.unit == ProgressUnit::bytes;
  const auto amount = [&](std::uint64_t n) { return bytes ? scaledBytes(static_cast<double>(n)) : formatCount(n); };
  const double rate = counting_s > 0 ? static_cast<double>(done) / counting_s : 0;
  std::string text = amount(done);
  if (options.total > 0) text += " of " + amount(options.total);
  if (!bytes && !options.noun.empty()) text += " " + options.noun;
  if (rate > 0) {
    char number[40];
    std::snprintf(number, sizeof number, rate < 10 ? "%.1f" : "%.0f", rate);
    text += ", " +
            (bytes         ? scaledBytes(rate)
             : rate >= 1e4 ? formatCount(static_cast<std::uint64_t>(rate))
                           : number) +
            "/s";
    if (options.total > done) text += ", " + duration(*timeLeft_s(options, done, counting_s)) + " left";
  }
  return text;
}

std::string Progress::jsonLine(std::chrono::steady_clock::time_point now) const {
  const auto since = [&](std::chrono::steady_clock::time_point t) {
    return std::chrono::duration<double>(now - t).count();
  };
  return jsonLine(options_, done_, since(started_), since(counting_));
}

std::string Progress::jsonLine(const ProgressOptions& options, std::uint64_t done, double elapsed_s,
                               double counting_s) {
  nlohmann::ordered_json json;
  json["progress"] = options.title;
  json["done"] = done;
  json["total"] = options.total > 0 ? nlohmann::ordered_json(options.total) : nlohmann::ordered_json(nullptr);
  json["unit"] = options.unit == ProgressUnit::bytes ? "bytes" : options.noun.empty() ? "items" : options.noun;
  json["elapsed_s"] = roundedToMilliseconds(elapsed_s);
  const std::optional<double> left_s = timeLeft_s(options, done, counting_s);
  json["left_s"] = left_s ? nlohmann::ordered_json(roundedToMilliseconds(*left_s)) : nlohmann::ordered_json(nullptr);
  return json.dump(-1, ' ', true, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

std::string Progress::line(const ProgressOptions& options, std::uint64_t done, double counting_s, int columns) {
  const double fraction =
      options.total == 0 ? 0 : std::min(1.0, static_cast<double>(done) / static_cast<double>(options.total));
  const std::string text = amounts(options, done, counting_s);
  std::string out = options.title;
  if (options.total > 0) {
    char percent[16];
    std::snprintf(percent, sizeof percent, " %3d%%", static_cast<int>(fraction * 100));
    // The bar takes the columns that the text leaves, at most 40.
    const int room = columns - static_cast<int>(out.size() + text.size()) - 10;
    if (room >= 8) {
      const int width = std::min(room, 40);
      const auto full = static_cast<std::size_t>(std::lround(fraction * width));
      out += " [" + std::string(full, '#') + std::string(static_cast<std::size_t>(width) - full, '-') + "]";
    }
    out += percent;
  }
  out += "  " + text;
  if (static_cast<int>(out.size()) > columns) out.resize(static_cast<std::size_t>(std::max(columns, 0)));
  return out;
}

}  // namespace filiform::tools
