// filiform serve as a process, among friendly and hostile clients at once, and over a set that is damaged meanwhile.
#include "tests/support/campaign.h"
#include "tests/support/folders.h"
#include "tests/support/sanitized.h"
#include "tests/support/servers/served_column.h"

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform {
namespace {

using test::fetch;
using test::ServerProcess;

class HostileClients : public test::ServedColumn {
 protected:
  HostileClients() : ServedColumn(10) {}
  // Runs support/servers/mixed_clients against the server and returns what it prints.
  nlohmann::json mixedClients(const ServerProcess& server, const std::string& options) {
    const std::string out = folder_ / "out";
    const std::string line = test::inSource("tests/support/servers/mixed_clients") + " " + server.address() + " t " +
                             options + " >" + out + " 2>" + (folder_ / "err");
    const int code = std::system(line.c_str());
    EXPECT_EQ(code, 0) << test::readBytes(out) << test::readBytes(folder_ / "err");
    return code == 0 ? nlohmann::json::parse(test::readBytes(out)) : nlohmann::json();
  }
};

TEST_F(HostileClients, OthersGetTheSameAnswersBesideThem) {
  test::writeBytes(folder_ / "token", "0123456789abcdef0123456789abcdef\n");
  ServerProcess server({set_, "--max-clients", "1100", "--token-file", folder_ / "token"}, folder_ / "log");
  const bool whole = test::wholeCampaign();
  const std::string pid = std::to_string(server.processId());
  const nlohmann::json counts =
      mixedClients(server, "--token 0123456789abcdef0123456789abcdef --pid " + pid +
                               (whole ? " --seconds 3600 --hostile 300 --idle 1000" : " --seconds 1 --hostile 3"));
  ASSERT_FALSE(counts.is_null());
  EXPECT_GT(counts.at("beside_hostile").at("answers"), 0);
  for (const auto& [kind, count] : counts.at("hostile").items()) EXPECT_GT(count, 0) << kind;
  if (whole) {
    // An hour of friendly clients, then five minutes of hostile ones beside them.
    EXPECT_LE(counts.at("resident_soaked").get<double>(), 1.02 * counts.at("resident_before").get<double>());
    test::tell("soak of an hour with mixed clients: " + counts.at("alone").dump() +
               ", then beside hostile ones: " + counts.at("beside_hostile").dump());
  }
  server.signal(SIGTERM);
  EXPECT_EQ(server.wait(), 0) << test::readBytes(folder_ / "log");
}

// Nobody but the attacker gets another answer than 200. The times are those of tools/serve/RESULTS.md.
TEST_F(HostileClients, AttacksHarmOnlyTheAttacker) {
  ServerProcess server({set_}, folder_ / "log");
  const std::string out = folder_ / "out";
  const std::string line = test::inSource("tests/support/servers/attacks") + " " + server.address() + " t --seconds " +
                           (test::wholeCampaign() ? "60" : "1") + " >" + out + " 2>&1";
  EXPECT_EQ(std::system(line.c_str()), 0) << test::readBytes(out) << test::readBytes(folder_ / "log");
  server.signal(SIGTERM);
  EXPECT_EQ(server.wait(), 0);
}

// Flips bytes of the packs under a server that keeps few tiles in memory.
TEST_F(HostileClients, ADamagedSetGivesErrorsAndNoWrongAnswer) {
  ServerProcess server({set_, "--budget", "200KiB"}, folder_ / "log");
  std::mt19937_64 random(5);
  std::vector<std::string> targets, answers;
  for (int i = 0; i < 60; ++i) {
    const auto coordinate = [&] { return std::to_string(static_cast<int>(random() % 1600) - 300); };
    targets.push_back("/v1/sets/t/nearest?k=2&at=" + coordinate() + "," + coordinate() + "," + coordinate());
    answers.push_back(fetch(server.port(), targets.back()).body);
  }
  for (const auto& entry : std::filesystem::recursive_directory_iterator(set_)) {
    if (entry.path().extension() != ".pack") continue;
    std::string bytes = test::readBytes(entry.path());
    for (std::size_t at = 64; at < bytes.size(); at += 1000) bytes[at] = static_cast<char>(~bytes[at]);
    std::ofstream(entry.path(), std::ios::binary | std::ios::in).write(bytes.data(), std::ssize(bytes));
  }
  int refused = 0;
  for (std::size_t i = 0; i < targets.size(); ++i) {
    const auto reply = fetch(server.port(), targets[i]);
    if (reply.status == 200) {
      EXPECT_EQ(reply.body, answers[i]) << targets[i];
      continue;
    }
    ++refused;
    EXPECT_EQ(reply.status, 500u) << targets[i];
    EXPECT_NE(reply.body.find("the set cannot be read"), std::string::npos) << reply.body;
  }
  const std::string metrics = fetch(server.port(), "/metrics").body,
                    damaged = "\nfiliform_damaged_tiles_total{set=\"t\"} ";
  ASSERT_NE(metrics.find(damaged), std::string::npos) << metrics;
  EXPECT_GT(std::stoi(metrics.substr(metrics.find(damaged) + damaged.size())), 0);
  EXPECT_GT(refused, 0) << "seed 5";
  EXPECT_EQ(fetch(server.port(), "/healthz").status, 200u);
}

}  // namespace
}  // namespace filiform
