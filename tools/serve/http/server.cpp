#include "tools/serve/http/server.h"

#include "index/errors.h"
#include "index/text.h"
#include "tools/serve/http/internal/connection.h"
#include "tools/serve/http/internal/hall.h"
#include "tools/serve/http/log_entry.h"

#include <algorithm>
#include <chrono>
#include <ctime>
#include <map>
#include <set>
#include <string_view>
#include <tuple>
#include <utility>

namespace filiform::tools {

namespace internal {

using boost::system::error_code;

// ADDRESS:PORT, with brackets round an IPv6 address.
tcp::endpoint endpointOf(const std::string& listen) {
  const auto refuse = [&]() -> UsageError {
    return UsageError("--listen " + escaped(listen, 80) + ": give ADDRESS:PORT, such as 127.0.0.1:7878 or [::1]:7878");
  };
  const std::size_t colon = listen.rfind(':');
  if (colon == std::string::npos) throw refuse();
  std::string host = listen.substr(0, colon);
  if (host == "localhost") host = "127.0.0.1";
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
  const std::string port = listen.substr(colon + 1);
  if (port.empty() || port.size() > 5 || port.find_first_not_of("0123456789") != std::string::npos) throw refuse();
  error_code wrong;
  const auto address = net::ip::make_address(host, wrong);
  const unsigned long number = std::stoul(port);
  if (wrong || number > 65535) throw refuse();
  return {address, static_cast<std::uint16_t>(number)};
}

void Hall::listen() {
  const tcp::endpoint endpoint = endpointOf(options.listen);
  if (options.open && !endpoint.address().is_loopback())
    throw UsageError("--listen " + escaped(options.listen, 80) +
                     ": other machines can reach this address; replace --no-token by --token-file");
  error_code error;
  acceptor.open(endpoint.protocol(), error);
  if (!error) acceptor.set_option(tcp::acceptor::reuse_address(true), error);
  if (!error) acceptor.bind(endpoint, error);
  if (!error) acceptor.listen(net::socket_base::max_listen_connections, error);
  if (error) throw IoError(escaped(options.listen, 80), "cannot listen", error.value());
  const tcp::endpoint local = acceptor.local_endpoint();
  const std::string host = local.address().to_string();
  address = "http://" + (local.address().is_v6() ? "[" + host + "]" : host) + ":" + std::to_string(local.port());
}

void Hall::accept() {
  acceptor.async_accept(arriving, [this](error_code error) {
    if (stopping) return;
    if (!error) {
      admit(std::move(arriving));  // which can then accept another
      return accept();
    }
    retry.expires_after(steadySeconds(0.1));  // usually: no descriptor is left
    retry.async_wait([this](error_code) {
      if (!stopping) accept();
    });
  });
}

// The client with the most connections gives one up: the one that waits longest for a whole request. If every
// connection has a request, a client that has more than half of all gives up the oldest one.
std::shared_ptr<Connection> Hall::leastNeeded(const std::string& newcomer) const {
  std::map<std::string, std::size_t> counts;
  for (const auto& one : connections) ++counts[one->share()];
  std::shared_ptr<Connection> found;
  for (const auto& one : connections) {
    if (one->hasRequest() && (counts[one->share()] <= options.most_clients / 2 || one->share() == newcomer)) continue;
    const auto rank = [&](const Connection& c) {
      return std::tuple(c.hasRequest(), options.most_clients * 2 - counts[c.share()], !c.isIdle(), c.since());
    };
    if (found == nullptr || rank(*one) < rank(*found)) found = one;
  }
  return found;
}

std::size_t Hall::socketsOf(const std::string& share) const {
  const auto own = [&](const auto& socket) { return shareOf(socket->clientAddress()) == share; };
  return static_cast<std::size_t>(std::count_if(sessions.sockets.begin(), sessions.sockets.end(), own) +
                                  std::count_if(desks.sockets.begin(), desks.sockets.end(), own));
}

void Hall::admit(TcpWire::Socket socket) {
  const std::size_t most =
      options.most_clients - std::min(options.most_clients, sessions.sockets.size() + desks.sockets.size());
  const auto connection = std::make_shared<Connection>(std::move(socket), *this);
  if (connections.size() >= most)
    if (const auto least = leastNeeded(connection->share())) least->close();
  const bool full = connections.size() >= most;
  if (full) ++metrics.refused_connections;
  if (connections.size() >= most + std::max<std::size_t>(4, options.most_clients / 4)) return;  // closes the socket
  connections.insert(connection);
  full ? connection->waitCrowded() : connection->waitForRequest();
}

void Hall::endOf(const std::shared_ptr<Connection>& connection) { connections.erase(connection); }

void Hall::tick() {
  const Clock::time_point now = Clock::now();
  if (!stopping && options.stop != nullptr && options.stop->load()) {
    if (!metrics.draining.exchange(true)) drain_until = now + steadySeconds(options.drain_first_s);
    if (now >= drain_until) beginToStop();
  }
  if (stopping && now >= stop_by)
    for (const auto& connection : std::set(connections)) connection->close();
  for (const auto& connection : std::set(connections))
    if (connection->isLate(now) || connection->hasLeft()) connection->close();
  for (const auto& socket : std::set(sessions.sockets)) stopping&& now >= stop_by ? socket->end() : socket->watch();
  for (const auto& socket : std::set(desks.sockets)) stopping&& now >= stop_by ? socket->end() : socket->watch();
  metrics.sessions = sessions.sockets.size();
  metrics.waiting = line.waiting();
  if (stopping && connections.empty() && sessions.sockets.empty() && desks.sockets.empty()) return io.stop();
  if (options.each_second && now >= next_second && !in_second.exchange(true)) {
    next_second = now + steadySeconds(1);
    line.add("", [this] {
      options.each_second();
      in_second = false;
    });
  }
  timer.expires_after(steadySeconds(0.025));
  timer.async_wait([this](error_code) { tick(); });
}

void Hall::beginToStop() {
  stopping = true;
  stop_by = Clock::now() + steadySeconds(options.drain_s);
  error_code ignored;
  acceptor.close(ignored);
  for (const auto& connection : std::set(connections))
    if (connection->isIdle()) connection->close();
  for (const auto& socket : std::set(sessions.sockets))
    socket->close(static_cast<unsigned>(CloseCode::going_away), "the server ends");
  for (const auto& socket : std::set(desks.sockets))
    socket->close(static_cast<unsigned>(DeskCode::going_away), "the server ends");
}

void Hall::logSocket(const char* route, const ServerSocket& socket) {
  const Person* const person = socket.person().get();
  metrics.count(route, 101, 0, socket.receivedBytes(), socket.sentBytes(), person != nullptr ? person->entry : "");
  if (options.log)
    options.log({std::time(nullptr), socket.clientAddress(), "GET", socket.target(), 101, socket.sentBytes(),
                 socket.seconds(), "", person != nullptr ? person->name : ""});
}

void Hall::run() {
  accept();
  tick();
  io.run();
  connections.clear();
  sessions.sockets.clear();
  desks.sockets.clear();
}

}  // namespace internal

struct Server::Impl {
  internal::Hall hall;
};

Server::Server(const Routes& routes, Metrics& metrics, const ServerOptions& options)
    : impl_(new Impl{internal::Hall(routes, metrics, options)}) {
  impl_->hall.listen();
}

Server::~Server() = default;

const std::string& Server::address() const { return impl_->hall.address; }

void Server::run() { impl_->hall.run(); }

}  // namespace filiform::tools
