// The server within the test: what happens when a client is too slow, with short times.
#include "tests/support/served_sets.h"
#include "tests/support/server_process.h"
#include "tools/serve/server.h"

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
  ServerTimes() {
    tools::ServerOptions options{.listen = "127.0.0.1:0"};
    options.header_s = options.body_s = options.idle_s = options.piece_s = 0.3;
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
  RawClient header(port_), body(port_), idle(port_);
  header.send("GET / HTTP/1.1\r\nHost: loc");
  body.send("POST /v1/sets/fork/nearest HTTP/1.1\r\nHost: localhost\r\nContent-Length: 100\r\n\r\nabc");
  EXPECT_EQ(header.readAll(10s), "");
  EXPECT_EQ(body.readAll(10s), "");
  EXPECT_EQ(idle.readAll(10s), "");
  EXPECT_EQ(test::fetch(port_, "/healthz").status, 200u);
}

TEST_F(ServerTimes, AClientThatDoesNotReadIsLeft) {
  const std::size_t points = 20000, k = 20;  // 23 MB, more than the system keeps for a socket
  const std::string body = test::npyOf(std::vector<Vector3d>(points, Vector3d(1, 2, 3)));
  RawClient client(port_);
  client.send("POST /v1/sets/column/nearest?k=" + std::to_string(k) +
              " HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/x-npy\r\nAccept: application/x-npy\r\n"
              "Content-Length: " +
              std::to_string(body.size()) + "\r\n\r\n" + body);
  for (int i = 0; i < 300 && sets_.metrics.answer_bytes == 0; ++i) std::this_thread::sleep_for(50ms);
  EXPECT_GT(sets_.metrics.answer_bytes, 0u);
  for (int i = 0; i < 200 && sets_.metrics.answer_bytes != 0; ++i) std::this_thread::sleep_for(50ms);
  EXPECT_EQ(sets_.metrics.answer_bytes, 0u);
  EXPECT_LT(client.readAll(10s).size(), points * k * 57) << "the answer is cut";
}

TEST_F(ServerTimes, StoppingEndsIdleConnections) {
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
