// The protocol without a socket: requests, errors, frames, limits, revisions.
#include "tools/serve/session/session_client.h"

#include "index/ingest/ingest.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/servers/served_sets.h"

#include <chrono>
#include <map>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

class SessionClients : public ::testing::Test {
 protected:
  nlohmann::json ask(SessionClient& client, const std::string& method, const std::string& params = "{}") {
    const std::string answer =
        client.answer(R"({"jsonrpc":"2.0","id":1,"method":")" + method + R"(","params":)" + params + "}");
    return nlohmann::json::parse(answer);
  }
  int codeOf(SessionClient& client, const std::string& method, const std::string& params = "{}") {
    const nlohmann::json answer = ask(client, method, params);
    return answer.contains("error") ? answer["error"]["code"].get<int>() : 0;
  }
  void send(SessionClient& client, double x_m, std::uint32_t ack = 0) {
    v1::Hand hand;
    hand.seq = ++seq_;
    hand.h_D[0] = x_m;
    hand.ack = ack;
    unsigned char bytes[v1::kHandBytes];
    v1::encode(hand, bytes);
    EXPECT_FALSE(client.receive(bytes));
  }
  // Waits for the next frames; the PROXY frames.
  std::vector<v1::Proxy> take(SessionClient& client, std::chrono::milliseconds most = std::chrono::seconds(20)) {
    std::vector<v1::Proxy> proxies;
    const auto until = std::chrono::steady_clock::now() + most;
    while (proxies.empty() && std::chrono::steady_clock::now() < until) {
      client.takeFrames([&](std::span<const unsigned char> bytes) {
        v1::Proxy proxy;
        if (v1::decode(bytes.data(), bytes.size(), proxy)) proxies.push_back(proxy);
        v1::ModelHead model;
        models_ += v1::decode(bytes.data(), bytes.size(), model);
      });
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return proxies;
  }

  test::ServedSets sets_;
  SessionHouse house_{*sets_.shelf, {.budget_bytes = std::uint64_t{64} << 20, .most_sessions = 3}};
  std::uint32_t seq_ = 0;
  int models_ = 0;
};

TEST_F(SessionClients, KnowOnlyTheSetsOfTheirPerson) {
  const auto ann = std::make_shared<const Person>(Person{.name = "ann", .key = "token", .sets = {"column"}});
  SessionClient client(house_, "0.0.0", ann);
  const nlohmann::json greeting = ask(client, "hello");
  ASSERT_EQ(greeting["result"]["sets"].size(), 1u) << greeting;
  EXPECT_EQ(greeting["result"]["sets"][0]["name"], "column");
  std::string hidden = ask(client, "open", R"({"set":"fork","cell":"fork"})").dump();
  hidden.replace(hidden.find("'fork'"), 6, "'gone'");
  EXPECT_EQ(hidden, ask(client, "open", R"({"set":"gone","cell":"fork"})").dump());
  EXPECT_EQ(codeOf(client, "open", R"({"set":"column"})"), 0);
}

TEST_F(SessionClients, TravelAndGetFrames) {
  SessionClient client(house_, "0.0.0");
  const auto hello = ask(client, "hello", R"({"protocol":"filiform.v1"})");
  EXPECT_EQ(hello.at("result").at("sets").size(), 2u);
  const auto opened = ask(client, "open", R"({"set":"fork","cell":"fork","sample":2,"hold_s":60})");
  EXPECT_EQ(opened.at("result").at("place").at("cell"), "fork");
  EXPECT_EQ(opened.at("result").at("place").at("p_um"), nlohmann::json({10.0, 0.0, 0.0}));
  EXPECT_EQ(ask(client, "subscribe", R"({"model_Hz":100,"radius_um":50})").at("result").at("model_Hz"), 100);
  std::uint32_t ack = 0;
  bool placed = false;
  for (int i = 0; i < 200 && !(placed && models_ > 0); ++i) {
    send(client, 0.001, ack);
    for (const v1::Proxy& proxy : take(client)) {
      ack = proxy.seq;
      placed = (proxy.flags & v1::kNoPlace) == 0 && proxy.p_W[0] > 0;
    }
  }
  EXPECT_TRUE(placed);
  EXPECT_GT(models_, 0);
  EXPECT_EQ(ask(client, "workspace", R"({"rotate_rad":[0,0.5],"centre":true})").at("result").at("mode"), "constrained");
  EXPECT_EQ(ask(client, "parameters", R"({"zoom_um":100})").at("result").at("zoom_um"), 100);
  EXPECT_EQ(ask(client, "follow", R"({"cell":"fork"})").at("result").at("cell"), "fork");
  EXPECT_EQ(ask(client, "follow", R"({"cell":null})").at("result").at("tiles"), 0);
  EXPECT_EQ(ask(client, "mode", R"({"mode":"free"})").at("result").at("mode"), "free");
  send(client, 0.002, ack);
  EXPECT_EQ(ask(client, "jump", R"({"at":[13,4,0],"under_hand":false})").at("result").at("place").at("cell"), "fork");
}

TEST_F(SessionClients, ErrorsSayWhatIsWrong) {
  SessionClient client(house_, "0.0.0");
  EXPECT_EQ(codeOf(client, "open", R"({"set":"fork"})"), RpcError::kOutOfOrder);
  EXPECT_EQ(codeOf(client, "hello", R"({"protocol":"filiform.v9"})"), RpcError::kParams);
  EXPECT_EQ(codeOf(client, "hello"), 0);
  EXPECT_EQ(codeOf(client, "dance"), RpcError::kNoMethod);
  EXPECT_EQ(codeOf(client, "jump", R"({"at":[0,0,0]})"), RpcError::kOutOfOrder);
  EXPECT_EQ(codeOf(client, "open", R"({"set":"none"})"), RpcError::kNotFound);
  const std::map<std::string, int> wrong{{R"({})", RpcError::kParams},
                                         {R"({"set":"fork","zoom_um":0})", RpcError::kParams},
                                         {R"({"set":"fork","zoom_um":"1"})", RpcError::kParams},
                                         {R"({"set":"fork","method":"magic"})", RpcError::kParams},
                                         {R"({"set":"fork","at":[0,0]})", RpcError::kParams},
                                         {R"({"set":"fork","at":[0,0,1e999]})", RpcError::kParse},
                                         {R"({"set":"fork","lo_m":[0,0,0],"hi_m":[0,1,1]})", RpcError::kParams},
                                         {R"({"set":"fork","cell":"nobody"})", RpcError::kNotFound},
                                         {R"({"set":"fork","cell":"fork","sample":99})", RpcError::kNotFound},
                                         {R"({"set":"fork","colour":1})", RpcError::kParams}};
  for (const auto& [params, code] : wrong) EXPECT_EQ(codeOf(client, "open", params), code) << params;
  EXPECT_EQ(house_.figures().open, 0u);
  EXPECT_EQ(codeOf(client, "open", R"({"set":"fork"})"), 0);
  EXPECT_EQ(codeOf(client, "mode", R"({"mode":"up"})"), RpcError::kParams);
  EXPECT_EQ(codeOf(client, "jump", R"({"at":[0,0,0],"cell":"fork"})"), RpcError::kParams);
}

TEST_F(SessionClients, AFailingOpenKeepsTheRunningSession) {
  SessionClient client(house_, "0.0.0"), second(house_, "0.0.0"), third(house_, "0.0.0");
  for (SessionClient* one : {&client, &second, &third}) {
    ask(*one, "hello");
    EXPECT_EQ(codeOf(*one, "open", R"({"set":"fork","cell":"fork","sample":2})"), 0);
  }
  for (const char* wrong : {R"({"set":"nope"})", R"({"set":"fork","cell":"nobody"})", R"({"set":"fork","zoom_um":0})",
                            R"({"set":"fork","at":[0,0]})"}) {
    EXPECT_NE(codeOf(client, "open", wrong), 0) << wrong;
    EXPECT_EQ(house_.figures().open, 3U) << wrong;
    EXPECT_EQ(codeOf(client, "parameters"), 0) << wrong;
  }
  // The session that it replaces does not count against the most.
  const auto opened = ask(client, "open", R"({"set":"fork","cell":"fork","sample":2,"zoom_um":50})");
  EXPECT_EQ(opened.at("result").at("zoom_um"), 50);
  EXPECT_EQ(house_.figures().open, 3U);
}

TEST_F(SessionClients, FramesThatAreNoHandEndTheConnection) {
  SessionClient client(house_, "0.0.0");
  const unsigned char bytes[64] = {9};
  const auto refused = client.receive(bytes);
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->code, CloseCode::unsupported);
  for (std::size_t i = 0; i < session_limits::kErrors; ++i) {
    EXPECT_FALSE(client.refusal());
    client.answer("{");
  }
  ASSERT_TRUE(client.refusal());
  EXPECT_EQ(client.refusal()->code, CloseCode::policy);
}

TEST_F(SessionClients, OnlySoManySessions) {
  std::vector<std::unique_ptr<SessionClient>> clients;
  for (int i = 0; i < 4; ++i) {
    clients.push_back(std::make_unique<SessionClient>(house_, "0.0.0"));
    ask(*clients.back(), "hello");
    EXPECT_EQ(codeOf(*clients.back(), "open", R"({"set":"column"})"), i < 3 ? 0 : RpcError::kBusy);
  }
  clients.erase(clients.begin());
  EXPECT_EQ(codeOf(*clients.back(), "open", R"({"set":"column"})"), 0);
  EXPECT_EQ(house_.figures().scenes, 1u);  // they share the tiles
}

// Unacknowledged, 8 frames come; the next one comes after an acknowledgement and is the newest.
TEST_F(SessionClients, AClientThatDoesNotAcknowledgeGetsEight) {
  SessionClient client(house_, "0.0.0");
  ask(client, "hello");
  ask(client, "open", R"({"set":"fork","at":[0,0,0],"hold_s":60})");
  ask(client, "subscribe", R"({"proxy_Hz":1000})");
  std::vector<v1::Proxy> got;
  for (int i = 0; i < 8; ++i)
    for (const v1::Proxy& proxy : take(client)) got.push_back(proxy);
  ASSERT_EQ(got.size(), 8u);
  EXPECT_TRUE(take(client, std::chrono::milliseconds(50)).empty());
  send(client, 0, got.back().seq);
  const std::vector<v1::Proxy> after = take(client);
  ASSERT_EQ(after.size(), 1u);
  EXPECT_EQ(after[0].seq, 9u);
  EXPECT_GT(after[0].replaced, 0u);
}

// A session keeps its revision, a new one gets the new one.
TEST_F(SessionClients, OldSessionsKeepTheirRevision) {
  SessionClient old_one(house_, "0.0.0"), new_one(house_, "0.0.0");
  ask(old_one, "hello"), ask(new_one, "hello");
  const auto before = ask(old_one, "open", R"({"set":"column","at":[0,0,0],"hold_s":60})").at("result").at("revision");
  CellList more(test::randomColumn(6, 4, 400, 300));
  ingest(more, sets_.folder / "column.fil", {.capacity = 128, .force = true});
  sets_.shelf->refresh();
  const auto after = ask(new_one, "open", R"({"set":"column","at":[0,0,0]})").at("result");
  EXPECT_NE(after.at("revision"), before);
  EXPECT_EQ(after.at("cells"), 4);
  EXPECT_EQ(ask(old_one, "jump", R"({"at":[50,0,0]})").at("result").contains("place"), true);
  send(old_one, 0.001);
  EXPECT_FALSE(take(old_one).empty());
  EXPECT_EQ(house_.figures().scenes, 2u);
}

TEST_F(SessionClients, AThousandReconnectsLeaveNothing) {
  for (int i = 0; i < 1000; ++i) {
    SessionClient client(house_, "0.0.0");
    ask(client, "hello");
    ASSERT_EQ(codeOf(client, "open", R"({"set":"fork","at":[0,0,0]})"), 0) << i;
    send(client, 0.001);
  }
  const SessionFigures figures = house_.figures();
  EXPECT_EQ(figures.open, 0u);
  EXPECT_EQ(figures.opened, 1000u);
  EXPECT_EQ(figures.scenes, 1u);
}

}  // namespace
}  // namespace filiform::tools
