// ServerOptions: how a Server listens, its limits, and what it serves. Thread rule: a value.
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace filiform::tools {

class SessionHouse;
class SetShelf;
struct LogEntry;

struct ServerOptions {
  std::string listen = "127.0.0.1:7878";    // ADDRESS:PORT or [ADDRESS]:PORT or localhost:PORT; port 0: a free one
  bool open = true;                         // no token is needed
  std::vector<std::string> proxies = {};    // addresses or networks whose X-Forwarded-For is believed
  std::string user_header = {};             // by which they name the user, in lower case; empty: none
  std::size_t most_clients = 256;           // open connections
  unsigned threads = 1;                     // that answer
  double header_s = 10;                     // for the header of a request
  double body_s = 30;                       // for its body
  double idle_s = 60;                       // between two requests of a connection
  double piece_s = 30;                      // for 256 KiB of an answer
  double drain_first_s = 0;                 // answer on for this time when the server stops, with 503 at /readyz
  double drain_s = 10;                      // for the answers in work when the server stops
  SessionHouse* sessions = nullptr;         // for /v1/session; nullptr: 404
  const SetShelf* desks = nullptr;          // for /v1/sets/{set}/desks; nullptr: 404
  std::string version = {};                 // of the program, for `hello`
  const std::atomic<bool>* stop = nullptr;  // true: accept nothing more, send the answers in work, return
  std::function<void()> each_second = {};   // called by a thread that answers
  std::function<void(const LogEntry&)> log = {};  // one call for each answered request, on the thread of run()
};

}  // namespace filiform::tools
