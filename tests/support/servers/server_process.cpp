#include "tests/support/servers/server_process.h"

#include "tests/support/process.h"

#include <algorithm>
#include <arpa/inet.h>
#include <cerrno>
#include <fstream>
#include <netinet/in.h>
#include <poll.h>
#include <stdexcept>
#include <sys/socket.h>
#include <unistd.h>

namespace filiform::test {

namespace {

std::vector<std::string> serveWords(const std::vector<std::string>& arguments) {
  std::vector<std::string> words{filiformProgram().string(), "serve"};
  words.insert(words.end(), arguments.begin(), arguments.end());
  const auto names = [](const std::string& word) { return word.starts_with("--token") || word == "--user-header"; };
  if (std::none_of(words.begin(), words.end(), names)) words.push_back("--no-token");
  words.insert(words.end(), {"--listen", "127.0.0.1:0"});
  return words;
}

}  // namespace

ServerProcess::ServerProcess(const std::vector<std::string>& arguments, const std::string& err)
    : StartedProcess(serveWords(arguments), err) {}

std::uint16_t ServerProcess::port() const {
  return static_cast<std::uint16_t>(std::stoi(address().substr(address().rfind(':') + 1)));
}

std::uint64_t ServerProcess::residentBytes() const {
  std::ifstream file("/proc/" + std::to_string(processId()) + "/statm");
  std::uint64_t total = 0, resident = 0;
  file >> total >> resident;
  return resident * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

RawClient::RawClient(std::uint16_t port, int receive_bytes)
    : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  if (receive_bytes > 0) ::setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &receive_bytes, sizeof receive_bytes);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) return;
  ::close(socket_);
  throw std::runtime_error("the server does not accept");
}

RawClient::~RawClient() { ::close(socket_); }

bool RawClient::send(const std::string& bytes) const {
  for (std::size_t sent = 0; sent < bytes.size();) {
    const ssize_t n = ::send(socket_, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    sent += static_cast<std::size_t>(n);
  }
  return true;
}

std::string RawClient::readAll(std::chrono::milliseconds most) const {
  std::string all = pending_;
  const auto end = std::chrono::steady_clock::now() + most;
  for (;;) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - std::chrono::steady_clock::now());
    pollfd ready{socket_, POLLIN, 0};
    if (left.count() <= 0 || ::poll(&ready, 1, static_cast<int>(left.count())) <= 0) return all;
    char bytes[65536];
    const ssize_t n = ::recv(socket_, bytes, sizeof bytes, 0);
    if (n <= 0) return all;
    all.append(bytes, static_cast<std::size_t>(n));
  }
}

RawClient::Reply RawClient::read(std::chrono::milliseconds most) {
  const auto end = std::chrono::steady_clock::now() + most;
  Reply reply;
  for (;;) {
    const std::size_t head_end = pending_.find("\r\n\r\n");
    if (head_end != std::string::npos) {
      const std::string head = pending_.substr(0, head_end + 4);
      if (head.starts_with("HTTP/1.1 100")) {
        pending_.erase(0, head.size());
        continue;
      }
      const std::size_t at = head.find("Content-Length: ");
      const std::size_t length = at == std::string::npos ? 0 : std::stoul(head.substr(at + 16));
      if (pending_.size() >= head.size() + length) {
        reply.status = static_cast<unsigned>(std::stoul(head.substr(9, 3)));
        reply.head = head;
        reply.body = pending_.substr(head.size(), length);
        pending_.erase(0, head.size() + length);
        return reply;
      }
    }
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - std::chrono::steady_clock::now());
    pollfd ready{socket_, POLLIN, 0};
    if (left.count() <= 0 || ::poll(&ready, 1, static_cast<int>(left.count())) <= 0) return reply;
    char bytes[65536];
    const ssize_t n = ::recv(socket_, bytes, sizeof bytes, 0);
    if (n <= 0) return reply;
    pending_.append(bytes, static_cast<std::size_t>(n));
  }
}

RawClient::Reply fetch(std::uint16_t port, const std::string& target, const std::map<std::string, std::string>& headers,
                       const std::string& body) {
  RawClient client(port);
  std::string text = (body.empty() ? "GET " : "POST ") + target + " HTTP/1.1\r\nHost: localhost\r\n";
  for (const auto& [name, value] : headers) text += name + ": " + value + "\r\n";
  if (!body.empty()) text += "Content-Length: " + std::to_string(body.size()) + "\r\n";
  client.send(text + "\r\n" + body);
  return client.read();
}

}  // namespace filiform::test
