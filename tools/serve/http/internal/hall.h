// Hall: what the connections of a server share. Included by server.cpp alone, because it needs Boost.Asio. Thread rule:
// the thread of run(), except where stated.
#pragma once

#include "tools/serve/http/answer_line.h"
#include "tools/serve/http/client_address.h"
#include "tools/serve/http/internal/desk_socket.h"
#include "tools/serve/http/internal/session_socket.h"
#include "tools/serve/http/internal/tcp_wire.h"
#include "tools/serve/http/server_options.h"
#include "tools/serve/people/secret.h"
#include "tools/serve/routes/routes.h"

#include <atomic>
#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <string>

#include <boost/asio/basic_socket_acceptor.hpp>
#include <boost/asio/basic_waitable_timer.hpp>

namespace filiform::tools::internal {

namespace net = boost::asio;
using net::ip::tcp;
using Clock = std::chrono::steady_clock;
using Timer = net::basic_waitable_timer<Clock, net::wait_traits<Clock>, TcpWire::Executor>;

inline Clock::duration steadySeconds(double seconds) {
  return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
}

class Connection;

struct Hall {
  Hall(const Routes& r, Metrics& m, const ServerOptions& o)
      : routes(r), metrics(m), options(o), proxies(o.proxies), line(o.threads) {
    sessions.house = o.sessions;
    sessions.version = o.version;
    sessions.log = [this](const ServerSocket& socket) { logSocket("/v1/session", socket); };
    desks.log = [this](const ServerSocket& socket) { logSocket("/v1/sets/{set}/desks/{desk}", socket); };
    if (o.sessions != nullptr) o.sessions->onNews([this] { wake(sessions); });
  }

  void listen();
  void run();
  void accept();
  void admit(TcpWire::Socket socket);
  std::shared_ptr<Connection> leastNeeded(const std::string& newcomer) const;
  std::size_t socketsOf(const std::string& share) const;
  void tick();
  void beginToStop();
  void logSocket(const char* route, const ServerSocket& socket);
  void endOf(const std::shared_ptr<Connection>& connection);

  const Routes& routes;  // any thread
  Metrics& metrics;      // any thread
  const ServerOptions options;
  const Proxies proxies;
  std::string address;
  net::io_context io{1};
  net::basic_socket_acceptor<tcp, TcpWire::Executor> acceptor{io};
  TcpWire::Socket arriving{io};
  Timer timer{io}, retry{io};
  std::set<std::shared_ptr<Connection>> connections;
  std::map<std::string, std::uint64_t> share_bytes;  // of large answers that are being sent, by client
  SessionHall sessions{io, line};
  DeskHall desks{io};
  bool stopping = false;
  const std::string start = randomText().substr(0, 8);  // of the ids of requests
  std::uint64_t requests = 0;
  Clock::time_point drain_until{}, stop_by{}, next_second = Clock::now();
  std::atomic<bool> in_second{false};  // each_second runs now; any thread
  AnswerLine line;                     // last: ends first
};

}  // namespace filiform::tools::internal
