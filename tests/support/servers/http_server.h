// HttpServer: http_server.py as a process, for tests of sets at an address.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace filiform::test {

// Thread rule: thread-compatible.
class HttpServer {
 public:
  // Serves the files below `root` at http://HOST:PORT + prefix. Throws std::runtime_error if Python cannot be started.
  explicit HttpServer(const std::string& root, const std::vector<std::string>& options = {},
                      const std::string& host = "127.0.0.1");
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;
  ~HttpServer();  // ends the process

  const std::string& url() const { return url_; }  // http://HOST:PORT
  std::string operator/(const std::string& path) const { return url_ + "/" + path; }

  // For the next `times` requests whose path contains `path`. http_server.py lists the kinds and their fields.
  void fault(const std::string& kind, const std::string& path, int times = 1,
             const nlohmann::json& fields = nlohmann::json::object());
  void clear();
  void delay(double s);
  // The requests since the last call: method, path, range, token, port.
  nlohmann::json log();

 private:
  nlohmann::json tell(const nlohmann::json& told);

  struct Process;
  std::unique_ptr<Process> process_;
  std::string url_;
};

}  // namespace filiform::test
