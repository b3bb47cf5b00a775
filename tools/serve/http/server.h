// Server: answers HTTP requests with Routes. Boost.Beast, in server.cpp alone.
//
//   Server server(routes, metrics, {.listen = "127.0.0.1:0"});
//   std::cout << server.address() << '\n';    // http://127.0.0.1:40123
//   server.run();                             // until options.stop is true
//
// One thread moves bytes and answers /healthz, /readyz and /metrics; others answer the rest (AnswerLine). A connection
// has one request in work at a time, and clients take turns. A client is an address, or an address behind a stated
// proxy; each has its share of connections. A person with a name, or else a client, has a share of memory and of work.
// README.md lists the limits.
#pragma once

#include "tools/serve/http/server_options.h"

#include <memory>
#include <string>

namespace filiform::tools {

class Metrics;
class Routes;

// Thread rule: one thread; run() blocks it.
class Server {
 public:
  // Listens. Throws UsageError for a wrong address, and for an address other than loopback if `open`. Throws IoError if
  // the port is taken. `routes` and `metrics` must outlive this object.
  Server(const Routes& routes, Metrics& metrics, const ServerOptions& options);
  ~Server();

  // http://ADDRESS:PORT
  const std::string& address() const;
  // Serves until `stop` is true.
  void run();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform::tools
