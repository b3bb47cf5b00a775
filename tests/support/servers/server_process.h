// `filiform serve` as a process, and a client that sends any bytes.
#pragma once

#include "tests/support/servers/started_process.h"

#include <chrono>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace filiform::test {

class ServerProcess : public StartedProcess {
 public:
  // Starts `filiform serve ARGUMENTS... --listen 127.0.0.1:0`, with --no-token unless they name tokens or users, and
  // waits for its address. Throws std::runtime_error if it prints none. `err`: the file for its standard error.
  ServerProcess(const std::vector<std::string>& arguments, const std::string& err);

  const std::string& address() const { return line(); }  // http://127.0.0.1:PORT
  std::uint16_t port() const;
  std::uint64_t residentBytes() const;
};

// Thread rule: thread-compatible.
class RawClient {
 public:
  // `receive_bytes`: the size of the system's receive buffer, about; 0: as usual. Throws std::runtime_error if the port
  // does not accept.
  explicit RawClient(std::uint16_t port, int receive_bytes = 0);
  ~RawClient();
  RawClient(const RawClient&) = delete;
  RawClient& operator=(const RawClient&) = delete;

  // False if the server has closed the connection.
  bool send(const std::string& bytes) const;
  // What comes until the end of the connection, or within the time.
  std::string readAll(std::chrono::milliseconds most) const;

  struct Reply {
    unsigned status = 0;  // 0: none came
    std::string head, body;
  };
  // One answer with a Content-Length.
  Reply read(std::chrono::milliseconds most = std::chrono::seconds(20));

 private:
  int socket_ = -1;
  std::string pending_;
};

// GET, or POST if there is a body, on a connection of its own.
RawClient::Reply fetch(std::uint16_t port, const std::string& target,
                       const std::map<std::string, std::string>& headers = {}, const std::string& body = "");

}  // namespace filiform::test
