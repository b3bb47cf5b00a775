// Sessions of `filiform serve` over WebSockets: clients of several kinds, wrong ones, and the end of the server.
#include "tests/support/folders.h"
#include "tests/support/sanitized.h"
#include "tests/support/servers/served_column.h"
#include "tools/lab/reference/service_socket.h"
#include "tools/serve/session/protocol.h"

#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform {
namespace {

using namespace std::chrono_literals;
using test::runFiliform;
using test::ServerProcess;
using tools::ServiceSocket;
using SessionFrame = ServiceSocket::Message::Kind;

constexpr const char* kSessionToken = "0123456789abcdef0123";

class SessionSockets : public test::ServedColumn {
 protected:
  std::uint16_t port() const { return server_->port(); }
  std::string shell(const std::string& line) const {
    return ServedColumn::shell("U=ws://127.0.0.1:" + std::to_string(port()) + "/v1/session; " + line);
  }
  static void open(ServiceSocket& client, const std::string& more = "") {
    client.ask("hello", "{}");
    const std::string answer = client.ask("open", R"({"set":"t","at":[0,700,0])" + more + "}");
    ASSERT_NE(answer.find("\"place\":{"), std::string::npos) << answer;
  }
  static bool sendHand(ServiceSocket& client, std::uint32_t seq, std::uint32_t ack, double x_m = 0.001) {
    v1::Hand hand;
    hand.seq = seq;
    hand.ack = ack;
    hand.h_D[0] = x_m;
    unsigned char bytes[v1::kHandBytes];
    v1::encode(hand, bytes);
    return client.sendBinary(bytes);
  }
  static std::optional<v1::Proxy> proxyOf(const ServiceSocket::Message& message) {
    v1::Proxy proxy;
    const auto* const bytes = reinterpret_cast<const unsigned char*>(message.bytes.data());
    if (message.kind != SessionFrame::binary || !v1::decode(bytes, message.bytes.size(), proxy)) return std::nullopt;
    return proxy;
  }
  // Reads to the close frame, and returns its code; 0: none came.
  static unsigned closeCode(ServiceSocket& client) {
    for (;;) {
      const ServiceSocket::Message message = client.read(30s);
      if (message.kind == SessionFrame::close) return message.code;
      if (message.kind == SessionFrame::ended || message.kind == SessionFrame::none) return 0;
    }
  }
};

TEST_F(SessionSockets, HandsGiveProxies) {
  start();
  ServiceSocket client(port(), {.headers = "Sec-WebSocket-Protocol: filiform.v1\r\n"});
  ASSERT_EQ(client.status(), 101u) << client.head();
  EXPECT_NE(client.head().find("Sec-WebSocket-Protocol: filiform.v1\r\n"), std::string::npos);
  open(client);
  std::uint32_t ack = 0, answered = 0;
  for (std::uint32_t seq = 1; seq <= 100 && answered < 100; ++seq) {
    ASSERT_TRUE(sendHand(client, seq, ack, 0.0001 * seq));
    while (answered < seq) {
      const auto proxy = proxyOf(client.read(20s));
      ASSERT_TRUE(proxy);
      ack = proxy->seq;
      answered = proxy->hand;
    }
  }
  EXPECT_EQ(answered, 100u);
}

TEST_F(SessionSockets, ForeignPagesAreRefusedAndTokensNeverRepeated) {
  test::writeBytes(folder_ / "token", std::string(kSessionToken) + "\n");
  start({"--token-file", folder_ / "token", "--origin", "https://lab.example"});
  EXPECT_EQ(ServiceSocket(port()).status(), 401u);
  const std::string bearer = std::string("Authorization: Bearer ") + kSessionToken + "\r\n";
  EXPECT_EQ(ServiceSocket(port(), {.headers = bearer + "Origin: https://evil.example\r\n"}).status(), 403u);
  EXPECT_EQ(ServiceSocket(port(), {.headers = bearer + "Origin: https://lab.example\r\n"}).status(), 101u);
  EXPECT_EQ(ServiceSocket(port(), {.headers = bearer}).status(), 101u);  // no Origin: no page of a browser
  const std::string protocols = std::string("Sec-WebSocket-Protocol: filiform.v1, filiform.token.") + kSessionToken;
  const ServiceSocket page(port(), {.headers = protocols + "\r\nOrigin: https://lab.example\r\n"});
  EXPECT_EQ(page.status(), 101u);
  EXPECT_NE(page.head().find("filiform.v1"), std::string::npos);
  EXPECT_EQ(page.head().find(kSessionToken), std::string::npos) << page.head();
  EXPECT_EQ(ServiceSocket(port(), {.headers = protocols + "x\r\n"}).status(), 401u);
  EXPECT_EQ(test::readBytes(folder_ / "err").find(kSessionToken), std::string::npos);
}

TEST_F(SessionSockets, WithoutAnUpgradeTheAnswerSaysWhatToDo) {
  start();
  const auto reply = test::fetch(port(), "/v1/session");
  EXPECT_EQ(reply.status, 426u);
  EXPECT_NE(reply.body.find("WebSocket"), std::string::npos);
}

TEST_F(SessionSockets, WrongFramesEndTheConnectionWithTheirCode) {
  start();
  {
    ServiceSocket client(port());
    client.sendBinary(std::vector<unsigned char>(64, 7));
    EXPECT_EQ(closeCode(client), 1003u);
  }
  {
    ServiceSocket client(port());
    client.sendText(std::string(70000, ' '));
    EXPECT_EQ(closeCode(client), 1009u);
  }
  {
    ServiceSocket client(port());
    client.sendText("\xff\xfe");
    EXPECT_EQ(closeCode(client), 1007u);
  }
  {
    ServiceSocket client(port());
    for (int i = 0; i < 100; ++i) {
      client.sendText("{");
      if (i < 99) client.text();
    }
    EXPECT_EQ(closeCode(client), 1008u);
  }
  {
    ServiceSocket client(port());
    client.sendRaw(std::string("\x81\x05hello", 7));  // without a mask
    EXPECT_EQ(closeCode(client), 1002u);
  }
  {
    ServiceSocket client(port());
    client.sendClose();
    EXPECT_EQ(closeCode(client), 1000u);
  }
  ServiceSocket after(port());  // others are served
  open(after);
}

TEST_F(SessionSockets, SigtermEndsSessionsWithTheirCode) {
  ServerProcess& server = start();
  ServiceSocket client(port());
  open(client);
  server.signal(SIGTERM);
  EXPECT_EQ(closeCode(client), 1001u);
  EXPECT_EQ(server.wait(), 0);
}

// A client that asks for much and reads nothing: the server's memory does not grow.
TEST_F(SessionSockets, AClientThatDoesNotReadHoldsNoMemory) {
  if (test::kSanitized) GTEST_SKIP() << "sanitizers keep freed memory";
  ServerProcess& server = start();
  std::vector<std::unique_ptr<ServiceSocket>> clients;
  for (int i = 0; i < 10; ++i) {
    clients.push_back(std::make_unique<ServiceSocket>(port(), tools::ServiceRequest{.receive_bytes = 4096}));
    open(*clients.back());
    clients.back()->ask("subscribe", R"({"proxy_Hz":1000,"model_Hz":100,"radius_um":1000})");
  }
  const std::uint64_t before = server.residentBytes();
  for (std::uint32_t seq = 1; seq <= 300; ++seq) {
    for (auto& client : clients) sendHand(*client, seq, seq < 8 ? 0 : seq - 7);
    std::this_thread::sleep_for(5ms);
  }
  EXPECT_LT(server.residentBytes(), before + (8u << 20));
}

TEST_F(SessionSockets, AThousandReconnects) {
  ServerProcess& server = start();
  const int count = test::kSanitized ? 100 : 1000;
  std::uint64_t before = 0;
  for (int i = 0; i < count; ++i) {
    ServiceSocket client(port());
    ASSERT_EQ(client.status(), 101u) << i;
    open(client);
    ASSERT_TRUE(sendHand(client, 1, 0));
    if (i % 3 == 0) client.sendClose();  // the others just go
    if (i == count / 10) before = server.residentBytes();
  }
  if (!test::kSanitized) {
    EXPECT_LT(server.residentBytes(), before + (16u << 20));
  }
  ServiceSocket client(port());
  open(client);
}

// Each session is recorded; the replay has the same bits.
TEST_F(SessionSockets, RecordingsReplayToTheBit) {
  const std::string recordings = folder_ / "rec";
  std::filesystem::create_directory(recordings);
  ServerProcess& server = start({"--record-sessions", recordings});
  {
    ServiceSocket client(port());
    open(client);
    std::uint32_t ack = 0;
    for (std::uint32_t seq = 1; seq <= 150; ++seq) {
      ASSERT_TRUE(sendHand(client, seq, ack, 0.0002 * seq));
      if (const auto proxy = proxyOf(client.read(20s))) ack = proxy->seq;
    }
    client.sendClose();
    closeCode(client);
  }
  server.signal(SIGTERM);
  EXPECT_EQ(server.wait(), 0);
  std::vector<std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(recordings))
    if (entry.path().extension() == ".rec") files.push_back(entry.path().string());
  ASSERT_EQ(files.size(), 1u) << test::readBytes(folder_ / "err");
  const auto replay = runFiliform({"replay", set_, files[0], "--json"});
  ASSERT_EQ(replay.exit_code, 0) << replay.out << replay.err;
  const auto json = nlohmann::json::parse(replay.out);
  EXPECT_EQ(json.at("hands"), 150);
  EXPECT_EQ(json.at("equal"), true);
  EXPECT_EQ(runFiliform({"replay", set_, folder_ / "none.rec"}).exit_code, 3);
}

TEST_F(SessionSockets, ThePythonExampleTravels) {
  if (std::system("/usr/bin/python3 -c 'import websockets' >/dev/null 2>&1") != 0)
    GTEST_SKIP() << "needs python3-websockets (tools/setup --service)";
  test::writeBytes(folder_ / "token", std::string(kSessionToken) + "\n");
  start({"--token-file", folder_ / "token"});
  const std::string script = "/usr/bin/python3 " + test::inSource("tools/examples/session/travel.py") + " $U ";
  const std::string said = shell(std::string("FILIFORM_TOKEN=") + kSessionToken + " " + script + "t 1");
  int proxies = 0, models = 0, nodes = 0;
  const std::size_t colon = said.find(": ");
  ASSERT_NE(colon, std::string::npos) << said;
  ASSERT_EQ(std::sscanf(said.c_str() + colon, ": %d PROXY, %d LOCAL MODEL, %d nodes", &proxies, &models, &nodes), 3)
      << said;
  EXPECT_GT(proxies, 0);
  EXPECT_GT(models, 0);
  EXPECT_GT(nodes, 1);
  EXPECT_NE(shell(script + "t 1").find("401"), std::string::npos);  // without the token
}

TEST_F(SessionSockets, TheCSharpExampleTravels) {
  if (std::system("command -v mcs >/dev/null 2>&1 && command -v mono >/dev/null 2>&1") != 0)
    GTEST_SKIP() << "needs mono-mcs and mono-runtime (tools/setup --service)";
  start();
  const std::string program = folder_ / "Travel.exe";
  const std::string said = shell("mcs " + test::inSource("tools/examples/session/Travel.cs") + " -out:" + program +
                                 " && mono " + program + " $U t");
  int proxies = 0, models = 0;
  ASSERT_EQ(std::sscanf(said.c_str(), "%d PROXY, %d LOCAL MODEL", &proxies, &models), 2) << said;
  EXPECT_GT(proxies, 0);
  EXPECT_GT(models, 0);
}

}  // namespace
}  // namespace filiform
