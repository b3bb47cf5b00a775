#include "tests/support/servers/http_server.h"

#include "tests/support/folders.h"

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <fcntl.h>
#include <stdexcept>
#include <sys/wait.h>
#include <unistd.h>

namespace filiform::test {

struct HttpServer::Process {
  pid_t child = -1;
  std::FILE* to = nullptr;
  std::FILE* from = nullptr;

  ~Process() {
    if (to != nullptr) std::fclose(to);
    if (from != nullptr) std::fclose(from);
    if (child <= 0) return;
    ::kill(child, SIGKILL);
    while (::waitpid(child, nullptr, 0) < 0 && errno == EINTR) {
    }
  }
  std::string line() const {
    std::string text;
    for (int c = 0; (c = std::fgetc(from)) != EOF && c != '\n';) text += static_cast<char>(c);
    return text;
  }
};

HttpServer::HttpServer(const std::string& root, const std::vector<std::string>& options, const std::string& host)
    : process_(std::make_unique<Process>()) {
  std::vector<std::string> words{"python3", inSource("tests/support/servers/http_server.py"), root, "--host",
                                 "127.0.0.1"};
  words.insert(words.end(), options.begin(), options.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  std::array<int, 2> in{}, out{};
  if (::pipe2(in.data(), O_CLOEXEC) != 0 || ::pipe2(out.data(), O_CLOEXEC) != 0)
    throw std::runtime_error("cannot make pipes");
  process_->child = ::fork();
  if (process_->child == 0) {
    ::dup2(in[0], 0);
    ::dup2(out[1], 1);
    ::execvp(argv[0], argv.data());
    ::_exit(127);
  }
  ::close(in[0]);
  ::close(out[1]);
  process_->to = ::fdopen(in[1], "w");
  process_->from = ::fdopen(out[0], "r");
  const std::string said = process_->line();
  if (!said.starts_with("port ")) throw std::runtime_error("cannot start tests/support/servers/http_server.py");
  url_ = "http://" + host + ":" + said.substr(5);
}

HttpServer::~HttpServer() = default;

nlohmann::json HttpServer::tell(const nlohmann::json& told) {
  const std::string line = told.dump() + "\n";
  std::fwrite(line.data(), 1, line.size(), process_->to);
  std::fflush(process_->to);
  return nlohmann::json::parse(process_->line());
}

void HttpServer::fault(const std::string& kind, const std::string& path, int times, const nlohmann::json& fields) {
  nlohmann::json told{{"do", "fault"}, {"kind", kind}, {"path", path}, {"times", times}};
  told.update(fields);
  tell(told);
}
void HttpServer::clear() { tell({{"do", "clear"}}); }
void HttpServer::delay(double s) { tell({{"do", "delay"}, {"s", s}}); }
nlohmann::json HttpServer::log() { return tell({{"do", "log"}}); }

}  // namespace filiform::test
