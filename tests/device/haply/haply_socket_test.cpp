// The driver and the simulated service by TCP, in real time; and both against Boost.Beast, so that an error that they
// share is found.
#include "device/haply/haply_device.h"
#include "device/haply/internal/haply_link.h"
#include "device/haply/simulated_haply.h"
#include "device/haply/simulated_haply_server.h"
#include "tests/support/no_alloc_guard.h"

#include <chrono>
#include <functional>
#include <thread>

#include <boost/asio/connect.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>
#include <gtest/gtest.h>

namespace filiform {
namespace {

using Eigen::Vector3d;
namespace beast = boost::beast;
using Tcp = boost::asio::ip::tcp;

Wrench rightwards(double force_N) {
  Wrench wrench;
  wrench.force_N.x() = force_N;
  return wrench;
}

struct SocketBench {
  explicit SocketBench(const SimulatedHaplyOptions& what = {}) : service(what), server(service) {
    options.port = server.port();
    options.timeout_s = 20;  // of a busy machine
  }
  // Exchanges until it holds; false after 20 s.
  bool await(HaplyDevice& haply, const Wrench& wrench, const std::function<bool(const DeviceState&)>& holds) {
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (std::chrono::steady_clock::now() < until)
      if (holds(haply.exchange(wrench))) return true;
    return false;
  }
  SimulatedHaply service;
  SimulatedHaplyServer server;
  HaplyOptions options;
};

bool isReady(const DeviceState& state) { return state.status == DeviceStatus::ready; }
bool isLost(const DeviceState& state) { return state.status == DeviceStatus::fault; }

TEST(HaplySocket, RendersAForceByTcp) {
  SocketBench bench;
  HaplyDevice haply(bench.options);
  haply.open();
  ASSERT_TRUE(bench.await(haply, {}, isReady));
  EXPECT_TRUE(bench.await(haply, rightwards(1), [](const DeviceState& state) { return state.sent_N->x() > 0.5; }));
  EXPECT_TRUE(bench.await(haply, rightwards(1), [](const DeviceState& state) { return state.p_D.x() > 0.001; }));
  haply.close();
  EXPECT_GT(bench.service.strongest_N(), 0.5);
}

TEST(HaplySocket, ATickNeitherAllocatesNorLocks) {
  SocketBench bench;
  HaplyDevice haply(bench.options);
  haply.open();
  ASSERT_TRUE(bench.await(haply, {}, isReady));
  const std::uint64_t before = haply.counters().states;
  test::NoAllocGuard guard;
  for (int i = 0; i < 200; ++i) haply.exchange(rightwards(0.01 * i));
  const test::ForbiddenCalls calls = guard.calls();
  EXPECT_EQ(calls.allocations, 0U) << calls.first;
  EXPECT_EQ(calls.locks, 0U) << calls.first;
  EXPECT_GT(haply.counters().states, before);
}

TEST(HaplySocket, ALostServiceIsAFaultThatIsExplained) {
  SocketBench bench;
  HaplyDevice haply(bench.options);
  haply.open();
  ASSERT_TRUE(bench.await(haply, {}, isReady));
  bench.service.faults().ends = true;
  EXPECT_TRUE(bench.await(haply, rightwards(1), isLost));
  EXPECT_NE(std::string(haply.advice()).find("ended the connection"), std::string::npos);
}

TEST(HaplySocket, AServiceThatIsSilentIsSentZero) {
  SocketBench bench;
  HaplyDevice haply(bench.options);
  haply.open();
  ASSERT_TRUE(bench.await(haply, {}, isReady));
  ASSERT_TRUE(bench.await(haply, rightwards(1), [](const DeviceState& state) { return state.sent_N->x() > 0.2; }));
  bench.service.faults().is_silent = true;
  EXPECT_TRUE(bench.await(haply, rightwards(1), [](const DeviceState& state) { return state.sent_N->isZero(); }));
  EXPECT_TRUE(bench.await(haply, rightwards(1), isLost));
  EXPECT_NE(std::string(haply.advice()).find("does not answer"), std::string::npos);
}

TEST(HaplySocket, SaysThatNoServiceRuns) {
  HaplyOptions options;
  {
    SimulatedHaply service;
    const SimulatedHaplyServer server(service);
    options.port = server.port();
  }
  HaplyDevice haply(options);
  try {
    haply.open();
    ADD_FAILURE() << "opened";
  } catch (const DeviceError& error) {
    EXPECT_NE(std::string(error.what()).find("does not run"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("systemctl start"), std::string::npos) << error.what();
  }
}

// A server of Boost.Beast that answers each message with its own text. Ends when its client goes.
TEST(HaplySocket, ItsWebSocketSpeaksWithBeastsServer) {
  boost::asio::io_context context;
  Tcp::acceptor acceptor(context, {boost::asio::ip::address_v4::loopback(), 0});
  const std::uint16_t port = acceptor.local_endpoint().port();
  std::string first_message;
  unsigned close_code = 0;
  std::thread server([&] {
    boost::system::error_code error;
    beast::websocket::stream<Tcp::socket> peer(acceptor.accept());
    peer.accept(error);
    peer.text(true);
    peer.write(boost::asio::buffer(std::string(R"({"inverse3":[{"device_id":"A"}]})")), error);
    peer.ping("are you there", error);
    for (beast::flat_buffer buffer; !error; buffer.clear()) {
      peer.read(buffer, error);
      if (error) break;
      if (first_message.empty()) first_message = beast::buffers_to_string(buffer.data());
      // In two frames, with a text longer than the small forms of the length.
      peer.write_some(false, boost::asio::buffer(std::string("{\"filler\":\"") + std::string(70, 'x')), error);
      peer.write_some(true, boost::asio::buffer(std::string("\",\"inverse3\":[]}")), error);
    }
    close_code = peer.reason().code;
  });
  internal::HaplyLink link;
  const internal::HaplyInventory inventory =
      link.open([port] { return connectTcp("127.0.0.1", port, 20); }, "127.0.0.1", 20);
  EXPECT_EQ(inventory.devices.size(), 1U);
  std::string answer;
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(link.send({.id = "A", .force_H = {1, 2, 3}}, 20));
    answer = link.receive(link.time_s() + 20);
  }
  link.close();
  server.join();
  EXPECT_EQ(answer, "{\"filler\":\"" + std::string(70, 'x') + "\",\"inverse3\":[]}");
  EXPECT_NE(first_message.find("org.filiform:main"), std::string::npos) << first_message;
  EXPECT_EQ(close_code, 1000U);
}

TEST(HaplySocket, TheSimulatedServiceSpeaksWithBeastsClient) {
  SocketBench bench;
  boost::asio::io_context context;
  beast::websocket::stream<Tcp::socket> client(context);
  client.next_layer().connect({boost::asio::ip::address_v4::loopback(), bench.server.port()});
  client.handshake("localhost", "/");
  beast::flat_buffer buffer;
  client.read(buffer);
  EXPECT_NE(beast::buffers_to_string(buffer.data()).find("\"session_id\":7"), std::string::npos);
  client.write(boost::asio::buffer(std::string(
      R"({"inverse3":[{"device_id":"049D","commands":{"set_cursor_force":{"vector":{"x":0,"y":0,"z":0.5}}}}]})")));
  buffer.clear();
  client.read(buffer);
  EXPECT_NE(beast::buffers_to_string(buffer.data()).find(R"("current_cursor_force":{"x":0,"y":0,"z":0.5})"),
            std::string::npos);
  client.close(beast::websocket::close_code::normal);
}

}  // namespace
}  // namespace filiform
