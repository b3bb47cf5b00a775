#include "tools/serve/sets/metrics.h"

#include "tools/serve/sets/set_shelf.h"
#include "tools/words/numbers.h"

#include <algorithm>

namespace filiform::tools {

namespace {

void describeMetric(std::string& text, const char* name, const char* type, const char* help) {
  ((((((text += "# HELP ") += name) += ' ') += help) += "\n# TYPE ") += name) += ' ';
  (text += type) += '\n';
}

void addMetric(std::string& text, const std::string& name, const std::string& labels, const std::string& value) {
  text += name;
  if (!labels.empty()) ((text += '{') += labels) += '}';
  ((text += ' ') += value) += '\n';
}

// A label's value: backslash, quote and line end are escaped.
std::string labelValue(const std::string& value) {
  std::string quoted = "\"";
  for (const char c : value) {
    if (c == '\\' || c == '"') quoted += '\\';
    if (c == '\n')
      quoted += "\\n";
    else
      quoted += c;
  }
  return quoted += '"';
}

}  // namespace

void Metrics::count(const std::string& route, unsigned status, double seconds, std::uint64_t bytes_in,
                    std::uint64_t bytes_out) {
  const std::lock_guard lock(mutex_);
  ++requests_[{route, status}];
  ++durations_[static_cast<std::size_t>(std::lower_bound(kBounds_s.begin(), kBounds_s.end(), seconds) -
                                        kBounds_s.begin())];
  seconds_ += seconds;
  bytes_in_ += bytes_in;
  bytes_out_ += bytes_out;
}

std::string Metrics::text(const SetShelf& shelf) const {
  std::string text;
  {
    const std::lock_guard lock(mutex_);
    describeMetric(text, "filiform_requests_total", "counter", "Requests, by route and status.");
    for (const auto& [key, count] : requests_)
      addMetric(text, "filiform_requests_total",
                "route=" + labelValue(key.first) + ",status=\"" + std::to_string(key.second) + '"',
                std::to_string(count));
    describeMetric(text, "filiform_request_seconds", "histogram",
                   "Time from the end of the header to the end of the answer.");
    std::uint64_t below = 0;
    for (std::size_t i = 0; i < durations_.size(); ++i) {
      below += durations_[i];
      addMetric(text, "filiform_request_seconds_bucket",
                "le=\"" + (i < kBounds_s.size() ? formatNumber(kBounds_s[i]) : std::string("+Inf")) + '"',
                std::to_string(below));
    }
    addMetric(text, "filiform_request_seconds_sum", "", formatNumber(seconds_));
    addMetric(text, "filiform_request_seconds_count", "", std::to_string(below));
    describeMetric(text, "filiform_received_bytes_total", "counter", "Bytes of request bodies.");
    addMetric(text, "filiform_received_bytes_total", "", std::to_string(bytes_in_));
    describeMetric(text, "filiform_sent_bytes_total", "counter", "Bytes of answers, without headers.");
    addMetric(text, "filiform_sent_bytes_total", "", std::to_string(bytes_out_));
  }
  describeMetric(text, "filiform_connections", "gauge", "Open connections.");
  addMetric(text, "filiform_connections", "", std::to_string(connections.load()));
  describeMetric(text, "filiform_refused_connections_total", "counter",
                 "Connections refused because of --max-clients.");
  addMetric(text, "filiform_refused_connections_total", "", std::to_string(refused_connections.load()));
  describeMetric(text, "filiform_answer_bytes", "gauge", "Bytes of answers in memory.");
  addMetric(text, "filiform_answer_bytes", "", std::to_string(answer_bytes.load()));
  describeMetric(text, "filiform_sessions", "gauge", "Open WebSockets of sessions.");
  addMetric(text, "filiform_sessions", "", std::to_string(sessions.load()));
  describeMetric(text, "filiform_session_ticks_total", "counter", "Ticks of all sessions.");
  addMetric(text, "filiform_session_ticks_total", "", std::to_string(session_ticks.load()));
  describeMetric(text, "filiform_session_late_ticks_total", "counter",
                 "Ticks of sessions that ended more than 1 ms after they were due, or were left out.");
  addMetric(text, "filiform_session_late_ticks_total", "", std::to_string(session_late_ticks.load()));
  describeMetric(text, "filiform_session_tile_bytes", "gauge", "Bytes of the tiles of all sessions in memory.");
  addMetric(text, "filiform_session_tile_bytes", "", std::to_string(session_tile_bytes.load()));
  describeMetric(text, "filiform_tile_bytes", "gauge", "Bytes of the tiles in memory, by set.");
  for (const auto& served : shelf.all())
    addMetric(text, "filiform_tile_bytes", "set=" + labelValue(served->name()),
              std::to_string(served->nearest().bytes()));
  describeMetric(text, "filiform_stale_sets", "gauge", "Sets whose newest revision cannot be read.");
  addMetric(text, "filiform_stale_sets", "", std::to_string(shelf.problems().size()));
  return text;
}

}  // namespace filiform::tools
