#include "tools/serve/sets/metrics.h"

#include "tools/serve/people/person.h"
#include "tools/serve/sets/set_shelf.h"
#include "tools/words/numbers.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sys/resource.h>
#include <system_error>
#include <unistd.h>

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

// What is told by set.
void addSets(std::string& text, const SetShelf& shelf, const Person& who) {
  const auto each = [&text](const char* name, const char* type, const char* help, const auto& items, auto value) {
    describeMetric(text, name, type, help);
    for (const auto& item : items)
      if (const auto [set, told] = value(item); !told.empty()) addMetric(text, name, "set=" + labelValue(set), told);
  };
  using State = SetShelf::State;
  const std::vector<State> states = shelf.states(&who);
  const auto ofState = [&](const char* name, const char* type, const char* help, auto member) {
    each(name, type, help, states, [&](const State& state) {
      return std::pair(state.name, std::to_string(static_cast<std::uint64_t>(state.*member)));
    });
  };
  ofState("filiform_set_open", "gauge", "1: the set is served, 0: it cannot be read.", &State::open);
  ofState("filiform_set_ready", "gauge", "1: the set is served in its newest revision.", &State::ready);
  ofState("filiform_set_requests_total", "counter", "Requests and sessions that named the set.", &State::requests);
  const auto served = shelf.all(&who);
  const auto ofSet = [&](const char* name, const char* type, const char* help, auto value) {
    each(name, type, help, served,
         [&](const auto& one) { return std::pair(one->name(), std::to_string(value(*one))); });
  };
  ofSet("filiform_tile_bytes", "gauge", "Bytes of the tiles in memory.",
        [](const ServedSet& one) { return one.nearest().bytes(); });
  ofSet("filiform_damaged_tiles_total", "counter", "Reads of tiles that were damaged, of this revision.",
        [](const ServedSet& one) { return one.store().damagedReads(); });
  const auto ofStore = [&](const char* name, const char* type, const char* help, auto value) {
    each(name, type, help, served, [&](const auto& one) {
      const std::optional<RemoteCounters> asked = one->set().remoteCounters();
      return std::pair(one->name(), asked ? formatNumber(static_cast<double>(value(*asked))) : std::string());
    });
  };
  using Asked = const RemoteCounters&;
  ofStore("filiform_store_requests_total", "counter",
          "Requests to the store of a set at an address, for this revision, without looks for a newer one.",
          [](Asked asked) { return asked.requests; });
  ofStore("filiform_store_retries_total", "counter", "Those of them that were sent again.",
          [](Asked asked) { return asked.retries; });
  ofStore("filiform_store_bytes_total", "counter", "Bytes from the store.", [](Asked asked) { return asked.bytes; });
  ofStore("filiform_store_silent_seconds", "gauge", "The store has not answered for this time, though reads wait.",
          [](Asked asked) { return asked.silent_s; });
  ofStore("filiform_cache_hits_total", "counter", "Reads of the store that the cache on disk answered.",
          [](Asked asked) { return asked.cache_hits; });
}

// What Prometheus' own libraries tell of a process that began at this time.
void addProcess(std::string& text, std::time_t began) {
  const auto one = [&text](const char* name, const char* type, const char* help, const std::string& value) {
    describeMetric(text, name, type, help);
    addMetric(text, name, "", value);
  };
  std::uint64_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages >> pages;
  one("process_resident_memory_bytes", "gauge", "Resident memory.",
      std::to_string(pages * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE))));
  struct rusage used {};
  ::getrusage(RUSAGE_SELF, &used);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  one("process_cpu_seconds_total", "counter", "User and system time.",
      formatNumber(seconds(used.ru_utime) + seconds(used.ru_stime)));
  std::error_code unreadable;
  std::uint64_t files = 0;
  for (std::filesystem::directory_iterator at("/proc/self/fd", unreadable), end; at != end && !unreadable;
       at.increment(unreadable))
    ++files;
  one("process_open_fds", "gauge", "Open files.", std::to_string(files));
  struct rlimit limit {};
  ::getrlimit(RLIMIT_NOFILE, &limit);
  one("process_max_fds", "gauge", "Most open files.", std::to_string(limit.rlim_cur));
  one("process_start_time_seconds", "gauge", "Start, since 1970.", std::to_string(began));
}

}  // namespace

void Metrics::count(const std::string& route, unsigned status, double seconds, std::uint64_t bytes_in,
                    std::uint64_t bytes_out, const std::string& entry) {
  const std::lock_guard lock(mutex_);
  ++requests_[{route, status}];
  if (!entry.empty()) ++people_[people_.size() < kMostEntries || people_.contains(entry) ? entry : "other"];
  Durations& durations = durations_[route];
  ++durations.counts[static_cast<std::size_t>(std::lower_bound(kBounds_s.begin(), kBounds_s.end(), seconds) -
                                              kBounds_s.begin())];
  durations.seconds += seconds;
  bytes_in_ += bytes_in;
  bytes_out_ += bytes_out;
}

std::string Metrics::text(const SetShelf& shelf, const std::string& version, const Person& who) const {
  std::string text;
  {
    const std::lock_guard lock(mutex_);
    describeMetric(text, "filiform_requests_total", "counter", "Requests, by route and status.");
    for (const auto& [key, count] : requests_)
      addMetric(text, "filiform_requests_total",
                "route=" + labelValue(key.first) + ",status=\"" + std::to_string(key.second) + '"',
                std::to_string(count));
    describeMetric(text, "filiform_request_seconds", "histogram",
                   "Time from the end of the header to the end of the answer, by route.");
    for (const auto& [name, durations] : durations_) {
      const std::string route = "route=" + labelValue(name);
      std::uint64_t below = 0;
      for (std::size_t i = 0; i < durations.counts.size(); ++i) {
        below += durations.counts[i];
        addMetric(text, "filiform_request_seconds_bucket",
                  route + ",le=\"" + (i < kBounds_s.size() ? formatNumber(kBounds_s[i]) : std::string("+Inf")) + '"',
                  std::to_string(below));
      }
      addMetric(text, "filiform_request_seconds_sum", route, formatNumber(durations.seconds));
      addMetric(text, "filiform_request_seconds_count", route, std::to_string(below));
    }
    describeMetric(text, "filiform_received_bytes_total", "counter", "Bytes of request bodies.");
    addMetric(text, "filiform_received_bytes_total", "", std::to_string(bytes_in_));
    describeMetric(text, "filiform_sent_bytes_total", "counter", "Bytes of answers, without headers.");
    addMetric(text, "filiform_sent_bytes_total", "", std::to_string(bytes_out_));
    describeMetric(text, "filiform_person_requests_total", "counter", "Requests, by entry in the file of --tokens.");
    for (const auto& [entry, count] : people_)
      if (who.seesAll() || entry == who.entry)
        addMetric(text, "filiform_person_requests_total", "person=" + labelValue(entry), std::to_string(count));
  }
  const auto one = [&text](const char* name, const char* type, const char* help, std::uint64_t value) {
    describeMetric(text, name, type, help);
    addMetric(text, name, "", std::to_string(value));
  };
  one("filiform_connections", "gauge", "Open connections.", connections);
  one("filiform_refused_connections_total", "counter", "Connections beyond --max-clients.", refused_connections);
  one("filiform_waiting_requests", "gauge", "Requests that wait for a thread.", waiting);
  one("filiform_left_answers_total", "counter", "Answers that were not finished, because their client left.",
      left_answers);
  one("filiform_refused_tokens_total", "counter", "Requests that were refused for want of the token.", refused_tokens);
  one("filiform_slowed_tokens_total", "counter", "Those after more than 20 wrong tokens in a minute from their client.",
      slowed_tokens);
  one("filiform_refused_quotas_total", "counter", "Requests that were refused because a quota was used.",
      refused_quotas);
  one("filiform_unreadable_total", "counter", "Answers that failed at a damaged or missing part of a set.", unreadable);
  one("filiform_answer_bytes", "gauge", "Bytes of answers of more than 1 MiB in memory.", answer_bytes);
  one("filiform_sessions", "gauge", "Open WebSockets of sessions.", sessions);
  one("filiform_session_ticks_total", "counter", "Ticks of all sessions.", session_ticks);
  one("filiform_session_late_ticks_total", "counter",
      "Ticks of sessions that ended more than 1 ms after they were due, or were left out.", session_late_ticks);
  describeMetric(text, "filiform_session_busy_seconds_total", "counter",
                 "Processor time of the threads that tick sessions.");
  addMetric(text, "filiform_session_busy_seconds_total", "", formatNumber(1e-3 * static_cast<double>(session_busy_ms)));
  one("filiform_session_tile_bytes", "gauge", "Bytes of the tiles of all sessions in memory.", session_tile_bytes);
  addSets(text, shelf, who);
  describeMetric(text, "filiform_stale_sets", "gauge", "Sets whose newest revision cannot be read.");
  addMetric(text, "filiform_stale_sets", "", std::to_string(shelf.problems().size()));
  describeMetric(text, "filiform_build_info", "gauge", "1; the label is the program's version.");
  addMetric(text, "filiform_build_info", "version=" + labelValue(version), "1");
  addProcess(text, began_);
  return text;
}

}  // namespace filiform::tools
