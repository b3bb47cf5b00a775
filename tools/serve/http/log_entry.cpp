#include "tools/serve/http/log_entry.h"

#include "index/text.h"
#include "tools/serve/routes/request.h"
#include "tools/words/answer.h"
#include "tools/words/numbers.h"

#include <cmath>
#include <ctime>

namespace filiform::tools {

std::string utcTime(std::int64_t time_s) {
  const auto time = static_cast<std::time_t>(time_s);
  std::tm utc{};
  gmtime_r(&time, &utc);
  char text[32];
  return std::string(text, std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc));
}

std::string logLine(const LogEntry& entry, LogFormat format) {
  constexpr std::size_t kMostTarget = 500;
  const std::string target = escaped(redacted(entry.target), kMostTarget), method = escaped(entry.method, 20);
  const double ms = std::round(entry.seconds * 1e5) / 100;
  const std::string user = escaped(entry.user, 128);
  if (format == LogFormat::json) {
    nlohmann::ordered_json json{
        {"time", utcTime(entry.time_s)}, {"client", entry.client}, {"method", method}, {"target", target},
        {"status", entry.status},        {"bytes", entry.bytes},   {"ms", ms},         {"id", escaped(entry.id, 64)}};
    if (!user.empty()) json["user"] = user;
    return jsonText(json);
  }
  return utcTime(entry.time_s) + ' ' + entry.client + ' ' + method + ' ' + target + ' ' + std::to_string(entry.status) +
         ' ' + std::to_string(entry.bytes) + " B " + formatNumber(ms) + " ms" +
         (entry.id.empty() ? "" : ' ' + escaped(entry.id, 64)) + (user.empty() ? "" : " user=" + user);
}

}  // namespace filiform::tools
