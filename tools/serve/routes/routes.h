// Routes: answers requests with the table of routes. Thread rule: immutable; internally synchronised where a Service
// is.
#pragma once

#include "tools/serve/routes/access.h"
#include "tools/serve/routes/route_table.h"
#include "tools/serve/routes/service.h"

#include <atomic>
#include <functional>
#include <optional>
#include <string>

namespace filiform::tools {

// The answer to a request, and the path of its route for the metrics; empty if no route fits.
struct Routed {
  Answer answer;
  std::string route = {};
};

class Routes {
 public:
  // `log` gets one line for each answer that fails with a server's error; any thread calls it. The service and what it
  // refers to must outlive this object.
  Routes(const Service& service, std::function<void(const std::string& line)> log);

  // Judges a request by its head, before the body is read: access, route, parameters, type of the body. Returns the
  // refusal or the answer to a preflight; nullopt: read the body and call answer(). O(length of the head).
  std::optional<Routed> refuse(Request& head) const;
  // Answers a request, for HEAD too (the server then leaves out the content). Calls parseTarget() if nobody did. Every
  // failure is an answer: 4xx for the request's, 503 for time and memory, 500 for the set's.
  // `left`: true as soon as nobody waits for the answer; the work then ends within 50 ms, or after the tile that it
  // reads.
  Routed answer(Request& request, const std::atomic<bool>* left = nullptr) const;
  // True for /healthz, /readyz and /metrics: they read no set, and take less than a millisecond.
  static bool isShort(const Request& request);

 private:
  struct Found;
  Found find(Request& request) const;
  void count(AccessRefusal::Reason reason) const;
  Routed finished(const Request& request, Answer answer, const char* route) const;

  const Service& service_;
  std::function<void(const std::string& line)> log_;
};

}  // namespace filiform::tools
