#include "tools/program/progress.h"

#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform::tools {
namespace {

using namespace std::chrono_literals;

ProgressOptions cells(std::uint64_t total) { return {"ingest", "cells", ProgressUnit::count, total}; }

TEST(Progress, SaysHowFarHowFastAndHowLong) {
  const std::string line = Progress::line(cells(1000), 250, 10, 100);
  EXPECT_EQ(line, "ingest [##########------------------------------]  25%  250 of 1 000 cells, 25/s, 30 s left");
  EXPECT_EQ(Progress::line(cells(0), 1234567, 10, 100), "ingest  1 234 567 cells, 123 456/s");
  const ProgressOptions bytes{"verify", "", ProgressUnit::bytes, 3ULL << 30};
  EXPECT_EQ(Progress::line(bytes, 1ULL << 30, 64, 60), "verify  33%  1.0 GiB of 3.0 GiB, 16.0 MiB/s, 2 min 08 s left");
  EXPECT_EQ(Progress::line(cells(1000), 1, 36, 100).find("35964 s"), std::string::npos) << "hours, not seconds";
  EXPECT_NE(Progress::line(cells(1000), 1, 36, 100).find("9 h 59 min left"), std::string::npos);
}

TEST(Progress, FitsTheTerminalAndSurvivesNonsense) {
  for (int columns = 0; columns < 120; ++columns) {
    for (const std::uint64_t done : {0ULL, 1ULL, 500ULL, 1000ULL, 99999999999ULL}) {
      const std::string line = Progress::line(cells(1000), done, done == 500 ? 0 : 3, columns);
      EXPECT_LE(line.size(), static_cast<std::size_t>(columns));
    }
  }
  EXPECT_NE(Progress::line(cells(1000), 99999, 1, 100).find("100%"), std::string::npos) << "more than all";
  EXPECT_EQ(Progress::line(cells(1000), 99999, 1, 100).find("left"), std::string::npos);
}

TEST(Progress, WritesTenTimesASecondAtMostAndCleansUp) {
  std::vector<std::string> written;
  auto now = std::chrono::steady_clock::time_point{};
  std::size_t looks = 0;
  {
    Progress progress(
        cells(1'000'000), [&](const std::string& text) { written.push_back(text); },
        [&] {
          ++looks;
          return now;
        },
        80);
    for (std::uint64_t i = 0; i < 1'000'000; ++i) {
      now += 1us;  // a second in all
      progress.update(i);
    }
    EXPECT_GE(written.size(), 5U);
    EXPECT_LE(written.size(), 10U);
    EXPECT_LT(looks, 2000U) << "the clock is not read on every call";
    for (const std::string& text : written) {
      EXPECT_EQ(text.front(), '\r');
      EXPECT_EQ(text.find('\n'), std::string::npos);
    }
  }
  EXPECT_EQ(written.back(), "\r\x1b[K") << "the line is gone at the end";
}

TEST(Progress, QuickWorkShowsNothing) {
  std::vector<std::string> written;
  {
    Progress progress(
        cells(10), [&](const std::string& text) { written.push_back(text); },
        [] { return std::chrono::steady_clock::time_point{}; }, 80);
    for (std::uint64_t i = 0; i < 10; ++i) progress.update(i);
  }
  EXPECT_TRUE(written.empty());
}

TEST(Progress, IsSilentWhereStderrIsNoTerminal) {
  testing::internal::CaptureStderr();
  {
    Progress progress(cells(10));
    const auto until = std::chrono::steady_clock::now() + 250ms;
    for (std::uint64_t i = 0; std::chrono::steady_clock::now() < until; ++i) progress.update(i);
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(Progress, JsonHasALineForEachStepAtLeast) {
  std::vector<nlohmann::json> written;
  auto now = std::chrono::steady_clock::time_point{};
  {
    Progress progress(
        cells(1000), [&](const std::string& text) { written.push_back(nlohmann::json::parse(text)); },
        [&] { return now; }, 80, true);
    now += 250ms;
    progress.update(0);
    now += 250ms;
    progress.update(500);
    now += 10ms;
    progress.update(1000);
  }
  const auto state = [](std::uint64_t done, double elapsed_s, const nlohmann::json& left_s) {
    return nlohmann::json{{"progress", "ingest"}, {"done", done},           {"total", 1000},
                          {"unit", "cells"},      {"elapsed_s", elapsed_s}, {"left_s", left_s}};
  };
  ASSERT_EQ(written.size(), 3U);
  EXPECT_EQ(written[0], state(0, 0.25, nullptr));
  EXPECT_EQ(written[1], state(500, 0.5, 0.25));  // the time before the amount grew says nothing about the rate
  EXPECT_EQ(written[2], state(1000, 0.51, 0.0));
  EXPECT_EQ(
      Progress::jsonLine({"verify", "", ProgressUnit::bytes, 0}, 7, 0, 0),
      "{\"progress\":\"verify\",\"done\":7,\"total\":null,\"unit\":\"bytes\",\"elapsed_s\":0.0,\"left_s\":null}\n");
}

}  // namespace
}  // namespace filiform::tools
