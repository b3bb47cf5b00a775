#include "tools/serve/http/answer_head.h"

#include <ctime>
#include <string_view>

namespace filiform::tools {

namespace {

std::string httpDate(std::int64_t time_s) {
  const auto time = static_cast<std::time_t>(time_s);
  std::tm utc{};
  gmtime_r(&time, &utc);
  char text[40];
  return std::string(text, std::strftime(text, sizeof text, "%a, %d %b %Y %H:%M:%S GMT", &utc));
}

}  // namespace

std::string answerHead(const Answer& answer, bool keep, std::int64_t time_s) {
  std::string head = "HTTP/1.1 " + std::to_string(answer.status) + ' ' + reasonPhrase(answer.status) + "\r\n";
  const auto add = [&](std::string_view name, std::string_view value) {
    (((head += name) += ": ") += value) += "\r\n";
  };
  add("Date", httpDate(time_s));
  if (!answer.type.empty()) add("Content-Type", answer.type);
  if (answer.status != 204 && answer.status != 304) add("Content-Length", std::to_string(answer.contentBytes()));
  for (const auto& [name, value] : answer.headers) add(name, value);
  add("X-Content-Type-Options", "nosniff");
  add("Referrer-Policy", "no-referrer");
  if (answer.header("Cross-Origin-Resource-Policy").empty()) add("Cross-Origin-Resource-Policy", "same-origin");
  if (!keep) add("Connection", "close");
  return head += "\r\n";
}

}  // namespace filiform::tools
