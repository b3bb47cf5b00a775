// The server within the test: what happens when a client is too slow, with short times.
#include "tests/support/servers/served_sets.h"
#include "tests/support/servers/server_process.h"
#include "tools/serve/http/server.h"

#include <atomic>
#include <chrono>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using namespace std::chrono_literals;
using test::RawClient;

class ServerTimes : public ::testing::Test {
 protected:
  // `request_s`: for a request, and between two. `piece_s`: for a piece of an answer.
  void start(double request_s, double piece_s) {
    tools::ServerOptions options{.listen = "127.0.0.1:0"};
    options.header_s = options.body_s = options.idle_s = request_s;
    options.piece_s = piece_s;
    options.drain_s = 1;
    options.stop = &stop_;
    server_.emplace(*sets_.routes, sets_.metrics, options);
    const std::string& address = server_->address();
    port_ = static_cast<std::uint16_t>(std::stoi(address.substr(address.rfind(':') + 1)));
    thread_ = std::thread([this] { server_->run(); });
  }
  ~ServerTimes() override {
    stop_ = true;
    thread_.join();
  }
  test::ServedSets sets_;
  std::atomic<bool> stop_{false};
  std::optional<tools::Server> server_;
  std::uint16_t port_ = 0;
  std::thread thread_;
};

TEST_F(ServerTimes, SlowRequestsEndTheConnection) {
  start(0.3, 10);
  RawClient header(port_), body(port_), idle(port_);
  header.send("GET / HTTP/1.1\r\nHost: loc");
  body.send("POST /v1/sets/fork/nearest HTTP/1.1\r\nHost: localhost\r\nContent-Length: 100\r\n\r\nabc");
  EXPECT_EQ(header.readAll(10s), "");
  EXPECT_EQ(body.readAll(10s), "");
  EXPECT_EQ(idle.readAll(10s), "");
  EXPECT_EQ(test::fetch(port_, "/healthz").status, 200u);
}

TEST_F(ServerTimes, AClientThatDoesNotReadIsLeft) {
  start(60, 0.3);
  const std::size_t points = 5000, k = 20;  // 5.7 MB, more than the system keeps for a socket
  const std::string body = test::npyOf(std::vector<Vector3d>(points, Vector3d(1, 2, 3)));
  RawClient client(port_, 4096);
  client.send("POST /v1/sets/column/nearest?k=" + std::to_string(k) +
              " HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/x-npy\r\nAccept: application/x-npy\r\n"
              "Content-Length: " +
              std::to_string(body.size()) + "\r\n\r\n" + body);
  for (int i = 0; i < 600 && sets_.metrics.connections == 0; ++i) std::this_thread::sleep_for(50ms);
  for (int i = 0; i < 600 && sets_.metrics.connections != 0; ++i) std::this_thread::sleep_for(50ms);
  EXPECT_EQ(sets_.metrics.connections, 0u);
  EXPECT_EQ(sets_.metrics.answer_bytes, 0u);
  const std::string answer = client.readAll(10s);
  EXPECT_EQ(answer.substr(0, 15), "HTTP/1.1 200 OK");
  EXPECT_LT(answer.size(), points * k * 57) << "the answer is cut";
}

TEST_F(ServerTimes, StoppingEndsIdleConnections) {
  start(60, 10);
  RawClient idle(port_);
  std::this_thread::sleep_for(50ms);
  stop_ = true;
  EXPECT_EQ(idle.readAll(5s), "");
  EXPECT_THROW(
      {
        std::this_thread::sleep_for(200ms);
        RawClient late(port_);
      },
      std::runtime_error);
}

}  // namespace
}  // namespace filiform
