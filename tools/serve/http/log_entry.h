// LogEntry: one line of the log for one request. Functions without state.
#pragma once

#include <cstdint>
#include <string>

namespace filiform::tools {

struct LogEntry {
  std::int64_t time_s = 0;     // since 1970
  std::string client;          // address
  std::string method, target;  // as sent; the line leaves out tokens
  unsigned status = 0;
  std::uint64_t bytes = 0;  // of the content
  double seconds = 0;
  std::string id = {};    // of the request
  std::string user = {};  // who asked; empty: nobody is known
};

enum class LogFormat { text, json };
// One line without its end: ASCII, no control characters; a long target is cut. O(length).
std::string logLine(const LogEntry& entry, LogFormat format);
// 2026-01-31T12:00:00Z.
std::string utcTime(std::int64_t time_s);

}  // namespace filiform::tools
