// Lines of the log: both forms, without tokens and control characters.
#include "tools/serve/http/log_entry.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform::tools {
namespace {

TEST(LogEntry, LinesHoldNoTokenAndNoControls) {
  const LogEntry entry{1767225600, "127.0.0.1", "GET", "/?token=secret&a=\x1b[31m\"", 303, 12, 0.0012345};
  EXPECT_EQ(logLine(entry, LogFormat::text),
            "2026-01-01T00:00:00Z 127.0.0.1 GET /?token=...&a=\\x1b[31m\" 303 12 B 1.23 ms");
  const auto json = nlohmann::json::parse(logLine(entry, LogFormat::json));
  EXPECT_EQ(json.at("target"), "/?token=...&a=\\x1b[31m\"");
  EXPECT_EQ(json.at("status"), 303);
  EXPECT_EQ(json.at("ms"), 1.23);
  LogEntry longer = entry;
  longer.id = "a1\n";
  EXPECT_TRUE(logLine(longer, LogFormat::text).ends_with(" ms a1\\n"));
  EXPECT_EQ(nlohmann::json::parse(logLine(longer, LogFormat::json)).at("id"), "a1\\n");
  EXPECT_FALSE(nlohmann::json::parse(logLine(longer, LogFormat::json)).contains("user"));
  longer.user = "ann\n@lab.example";
  EXPECT_TRUE(logLine(longer, LogFormat::text).ends_with(" ms a1\\n user=ann\\n@lab.example"));
  EXPECT_EQ(nlohmann::json::parse(logLine(longer, LogFormat::json)).at("user"), "ann\\n@lab.example");
  longer.target = "/" + std::string(8000, 'x');
  EXPECT_LT(logLine(longer, LogFormat::text).size(), 700u);
}

}  // namespace
}  // namespace filiform::tools
